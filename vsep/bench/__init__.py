"""Bench of interference mitigation: frozen scenes on which any method is measured the same way."""
