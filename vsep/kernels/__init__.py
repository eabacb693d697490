"""Compiled inner loops: functions of arrays, each with its equation."""
