"""Interference estimation: chirp search, refinement and channel of every ramp."""
