"""What a received frame is made of."""
