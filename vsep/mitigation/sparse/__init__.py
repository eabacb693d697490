"""Compressive-sensing mitigation: a sparse range-Doppler spectrum from the clean samples."""
