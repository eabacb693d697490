"""Yardsticks: bounds, multi-object metrics, separability and intervals of what was measured."""
