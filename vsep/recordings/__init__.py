"""Recordings of real sensors: what a settings file says of them, and frames made of them."""
