"""Separability maps over two parameters of a scene."""
