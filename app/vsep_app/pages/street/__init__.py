"""Page that plays the simulated street at the pace of the radar."""
