"""Reports: a run as a file that needs neither server nor network, and that can be made again."""
