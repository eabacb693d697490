"""What a receiver's own bursts tell about it: its complex response, estimated from recordings."""
