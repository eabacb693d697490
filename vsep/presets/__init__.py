"""Presets: radars with scenes in front of them, one record each."""
