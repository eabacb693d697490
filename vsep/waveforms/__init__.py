"""Waveforms of the victim beyond equal ramps of one transmitter."""
