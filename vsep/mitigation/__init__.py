"""The other ways to deal with interference: find the samples it hits, and repair them."""
