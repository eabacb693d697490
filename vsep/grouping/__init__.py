"""Extended objects: components that belong together, as a layer over an estimate."""
