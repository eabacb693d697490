"""Object estimation: sparse Bayesian learning of a grid-less line spectrum."""
