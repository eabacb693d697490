"""Signal model: radars, scenes, filters, atoms, templates and simulation."""
