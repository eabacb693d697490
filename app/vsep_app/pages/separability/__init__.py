"""Page of separability maps."""
