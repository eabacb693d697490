"""Guided experiments and help: what a lecture needs beside the views."""
