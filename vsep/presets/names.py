"""Names of the presets, apart from their scenes: the command line needs no more to start."""

PRESET_NAMES = ("simulation-1", "simulation-2-a", "simulation-2-b", "simulation-2-c")
