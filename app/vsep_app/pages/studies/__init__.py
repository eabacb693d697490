"""Studies in the dashboard and as figures: run, watch, draw, open a single trial."""
