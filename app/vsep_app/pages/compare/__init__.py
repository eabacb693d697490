"""The page that shows several methods side by side on the same frames."""
