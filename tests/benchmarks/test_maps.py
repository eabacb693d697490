"""Time of the laboratory's maps of 64 x 64 cells, against the dense formulas cell by cell."""

import numpy as np
import pytest

from vsep.analysis.separability import separability
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.map_spec import MapSpec
from vsep.studies.trial_scenario import simulate_trial

SLOPE = "slope_difference=-2e12:-1e11:64"
MAPS = {
    "map of Simulation I over SIR and slope": ("simulation-1", "sir_db=-40:40:64", SLOPE),
    "map of Simulation I over delay and slope": (
        "simulation-1",
        "object_delay=-2e-7:2e-7:64",
        SLOPE,
    ),
    "map of Simulation I over filter and slope": (
        "simulation-1",
        "filter_cutoff=1e6:5e6:64",
        SLOPE,
    ),
    "map of Simulation II c over SIR and slope": ("simulation-2-c", "sir_db=-40:40:64", SLOPE),
    "map of Simulation II c over delay and slope": (
        "simulation-2-c",
        "object_delay=-2e-7:2e-7:64",
        SLOPE,
    ),
}
# Cells that are evaluated one by one; the time of all is in proportion.
SAMPLED = 16


@pytest.mark.benchmark(group="separability")
@pytest.mark.parametrize("part", MAPS)
def test_map(timed, part):
    scene, x, y = MAPS[part]
    maps = MapSpec(scene=scene, x=parse_axis(x), y=parse_axis(y))
    found = timed(lambda: analytic_map(maps), part=part, rounds=5)
    assert np.all(np.isfinite(found.coherence))


@pytest.mark.benchmark(group="separability")
def test_cells_one_by_one(timed):
    scene, x, y = MAPS["map of Simulation I over SIR and slope"]
    maps = MapSpec(scene=scene, x=parse_axis(x), y=parse_axis(y))

    def one_by_one():
        for cell in range(SAMPLED):
            bench = simulate_trial(maps.trial((cell, cell)))
            truth = bench.truth
            lines = truth.beats, truth.dopplers, truth.amplitudes
            ratio = separability(*lines, truth.interference_signal)
            bench.bounds()
        return ratio

    part = f"{SAMPLED} of the 4096 cells one by one: frame, (27), bounds"
    assert np.isfinite(timed(one_by_one, part=part, rounds=5).whole_db)
