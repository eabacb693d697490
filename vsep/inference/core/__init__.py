"""Estimator protocol, state, run loop and schedules."""
