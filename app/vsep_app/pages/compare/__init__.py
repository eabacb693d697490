"""Page of several methods side by side on the same frames."""
