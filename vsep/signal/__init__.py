"""Signal model of a received frame: radar, atoms, filters, scene, simulation."""
