"""How a received frame is taken apart."""
