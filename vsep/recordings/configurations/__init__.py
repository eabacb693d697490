"""Configurations of sensors as their tools write them, read as settings of a recording."""
