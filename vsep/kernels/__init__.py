"""Compiled inner loops: plain functions of arrays, each with its equation, called by the rooms."""
