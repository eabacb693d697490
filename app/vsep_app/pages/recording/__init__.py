"""The page of recorded data: what a file is, and the separation of its frame."""
