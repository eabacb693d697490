"""Interference: search, refinement and channels of bursts."""
