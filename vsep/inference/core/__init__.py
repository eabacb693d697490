"""Parts that all estimators share: protocol, state, run, schedule, thresholds."""
