"""Error bounds, multi-object metrics, separability and confidence intervals."""
