"""Objects: sparse Bayesian learning, object-only and masked estimators, uncertainty."""
