"""Find the samples of a frame that interference hits, without knowing the truth."""
