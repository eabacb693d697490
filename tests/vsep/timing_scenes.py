"""What a second pass with the interferer's timing is worth: weak bursts found, and false ones.

As a script it writes the table of `assets/docs/recordings.md`:

    python -m tests.vsep.timing_scenes assets/results
"""

import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.vsep.result_tables import write_table
from vsep.analysis.intervals import binomial_interval, poisson_interval
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import preset_radar
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.two_pass import run_twice

VALUES = {"slope_hz_per_s": 29e12, "sample_rate_hz": 20e6, "ramp_period_s": 20e-6}
RADAR = replace(preset_radar("simulation-1"), start_frequency_hz=77e9, num_ramps=64, **VALUES)
MODEL = SignalModel.of_radar(RADAR, RaisedCosineFilter(cutoff_hz=5e6, rolloff=0.25))
STRONG_DB = 25.0  # energy of a burst over the noise power of a sample
FRAMES = 12
NEAR = 3.0  # samples within which a burst is the true one


class Places(NamedTuple):
    """Bursts of a frame: ramps, centres in samples, and energies over the noise power."""

    ramps: np.ndarray
    centres: np.ndarray
    energies: np.ndarray


def drawn_frame(slope_hz_per_s, weak_db, seed):
    """Noise and the bursts of one interferer: strong, weak and missing, a third of the places each.

    Its chirps cross the victim's ramps as equal intervals have it, worked out here.
    """
    rng = np.random.default_rng([seed, round(abs(slope_hz_per_s) / 1e9)])
    chirp = RADAR.slope_hz_per_s + slope_hz_per_s
    drift = -chirp * RADAR.ramp_period_s / slope_hz_per_s * RADAR.sample_rate_hz
    step = rng.uniform(400.0, 500.0)  # samples: a place in every other ramp
    first = rng.uniform(0.0, step)
    ramps, centres = [], []
    for ramp in range(RADAR.num_ramps):
        offset = (drift * ramp + first) % step
        while offset < RADAR.num_samples - 10.0:
            if offset >= 10.0:
                ramps.append(ramp)
                centres.append(offset)
            offset += step
    kind = rng.integers(0, 3, len(ramps))
    energies = 10.0 ** (np.choose(kind, [STRONG_DB, weak_db, -np.inf]) / 10.0)
    slope = slope_hz_per_s / RADAR.sample_rate_hz**2
    templates = MODEL.template(-slope * np.array(centres), np.full(len(ramps), slope))
    norms = np.sqrt(np.sum(np.abs(templates) ** 2, axis=1))
    phases = np.exp(2j * np.pi * rng.random(len(ramps)))
    draws = rng.standard_normal((2, *RADAR.shape)) / np.sqrt(2.0)
    frame = draws[0] + 1j * draws[1]
    weights = np.sqrt(energies) * phases / norms
    np.add.at(frame, ramps, weights[:, None] * templates)
    return frame, Places(np.array(ramps), np.array(centres), energies)


def judged(bursts, places, weak_db):
    """Return how many weak bursts there are, how many were found, and the false bursts."""
    weak = np.isclose(places.energies, 10.0 ** (weak_db / 10.0))
    there = places.energies > 0.0
    found, false = np.zeros(len(weak), dtype=bool), 0
    for burst in bursts:
        near = there & (places.ramps == burst.ramp)
        near &= np.abs(places.centres - burst.centre) <= NEAR
        found |= near
        false += burst.num_components > 0 and not near.any()
    return int(weak.sum()), int((found & weak).sum()), false


def compared(slope_hz_per_s, weak_db, seed):
    """Return the counts of `judged` without and with the second pass, and whether it took place."""
    frame, places = drawn_frame(slope_hz_per_s, weak_db, seed)
    separator = FactorisedSeparator(model=MODEL)
    once = run(separator, frame)
    twice, timings = run_twice(separator, frame, RADAR)
    plain, prior = (judged(each.state.bursts, places, weak_db) for each in (once, twice))
    return plain, prior, len(timings)


def rows_of(slope_hz_per_s, weak_db):
    """Yield the rows of the table for one slope and level, without and with the second pass."""
    outcomes = [compared(slope_hz_per_s, weak_db, seed) for seed in range(FRAMES)]
    for index, method in enumerate(("search alone", "with the timing")):
        bursts, found, false = np.sum([each[index] for each in outcomes], axis=0).tolist()
        share = binomial_interval(found, bursts)
        rate = poisson_interval(false, FRAMES * RADAR.num_ramps)
        yield {
            "slope_difference_hz_per_s": slope_hz_per_s,
            "energy_db": weak_db,
            "method": method,
            "found": share.value,
            "low": share.low,
            "high": share.high,
            "bursts": bursts,
            "false_a_ramp": rate.value,
            "false_low": rate.low,
            "false_high": rate.high,
            "ramps": rate.num_samples,
        }


if __name__ == "__main__":
    places = product((-19e12, -6e12), (8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0))
    table = (row for place in places for row in rows_of(*place))
    write_table(Path(sys.argv[1]) / "interferer-timing.csv", table)
