"""Background work: worker pool, run loop, shared runs."""
