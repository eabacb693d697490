"""Frame files and result lines."""
