"""Calibration of a receiver's complex response from its own bursts."""
