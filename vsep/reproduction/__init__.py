"""Reproduction of the figures and the numbers of both source papers."""
