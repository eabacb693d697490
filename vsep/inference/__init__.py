"""Variational inference of the object and interference signals of a received frame."""
