"""Presets: the scenes of Table I and the recorded frame."""
