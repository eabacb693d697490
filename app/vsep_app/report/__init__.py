"""Reports: reproducible files of a run that need neither server nor network."""
