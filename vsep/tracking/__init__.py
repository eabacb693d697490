"""Sequences of frames: each separated from what the last one predicts, objects followed by name."""
