"""Calibration of a receiver's complex response from bursts in recordings."""
