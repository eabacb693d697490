"""What is measured of several antennas: false alarms, detection, bounds and angles.

As a script it writes the table of `assets/docs/antennas.md`:

    python -m tests.vsep.antenna_bench assets/results
"""

import sys
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.vsep.result_tables import write_table
from vsep.analysis.angles import angle_bound_deg, object_angles
from vsep.analysis.crlb import shared_dispersion_bound
from vsep.analysis.intervals import (
    binomial_interval,
    bootstrap_interval,
    median,
    poisson_interval,
    root_mean_square,
)
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.scenes import preset
from vsep.signal.atoms import gram, line_factors
from vsep.signal.filters import NoFilter
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.simulate import simulate_antennas
from vsep.signal.template import SignalModel

SIDES = 60.0  # degrees to both sides of broadside within which directions are drawn
HIT = 0.5  # cells


class Outcome(NamedTuple):
    """What a run found of each true object of one frame: errors are NaN where it is missed.

    Beat errors are over their root CRLB. Angle errors are over that of a line of antennas whose
    noise is the variance of weights that are estimated together at known places.
    """

    hits: np.ndarray
    beat_errors: np.ndarray
    angle_errors: np.ndarray
    false_alarms: int
    noise_ratio: float
    iterations: int


def antenna_frame(name, num_antennas, *, snr_db, sir_db, seed, interference=True):
    """Frame (A, P, N) of a preset, its directions drawn; SNR and SIR are those of one antenna."""
    rng = np.random.default_rng(seed)
    drawn = preset(name, snr_db=snr_db, sir_db=sir_db, rng=rng, interference=interference)
    scene = AntennaScene(
        scene=drawn.scene,
        antennas=UniformLinearArray(num_antennas=num_antennas),
        object_angles_deg=rng.uniform(-SIDES, SIDES, drawn.scene.objects.num_paths),
        interferer_angles_deg=rng.uniform(-SIDES, SIDES, len(drawn.scene.interferers)),
    )
    observation = simulate_antennas(
        drawn.radar, scene, anti_aliasing_filter=drawn.anti_aliasing_filter, rng=rng
    )
    return drawn, scene, observation


def separated(name, num_antennas, *, snr_db, sir_db, seed, interference=True, rate=0.05):
    """Separate one frame and compare with its truth."""
    drawn, scene, observation = antenna_frame(
        name, num_antennas, snr_db=snr_db, sir_db=sir_db, seed=seed, interference=interference
    )
    model = SignalModel.of_radar(drawn.radar, drawn.anti_aliasing_filter, num_antennas)
    received = observation.received if num_antennas > 1 else observation.received[0]
    solution = run(FactorisedSeparator(model=model, false_alarm_rate=rate), received)
    return outcome(solution, scene, observation.truth, model)


def outcome(solution, scene, truth, model):
    """Assign to every true object the nearest found one within half a cell."""
    objects, free = solution.objects, list(range(solution.objects.num_components))
    bound = shared_dispersion_bound(truth, model)
    power = np.abs(truth.amplitudes[:, 0]) ** 2 * truth.noise_precision
    angles = scene.object_angles_deg
    shape = len(angles)
    hits, beats, turns = np.zeros(shape, bool), np.full(shape, np.nan), np.full(shape, np.nan)
    several = model.num_antennas > 1
    if several:
        variances = np.diagonal(objects.covariance).real
        found = object_angles(objects.amplitudes, variances, 0.5)
        beat_lines = line_factors(truth.beats, model.num_samples)
        columns = gram(beat_lines, line_factors(truth.dopplers, model.num_ramps))
        seen = power / np.diagonal(np.linalg.inv(columns)).real
        angle_bound = angle_bound_deg(seen, angles, model.num_antennas, 0.5)
    for index in np.argsort(-power):
        if not free:
            break
        beat = objects.beats[free] - truth.beats[index]
        doppler = objects.dopplers[free] - truth.dopplers[index]
        cells = np.hypot(
            ((beat + 0.5) % 1.0 - 0.5) * model.num_samples,
            ((doppler + 0.5) % 1.0 - 0.5) * model.num_ramps,
        )
        place = int(np.argmin(cells))
        if cells[place] > HIT:
            continue
        own = free.pop(place)
        hits[index] = True
        beats[index] = (objects.beats[own] - truth.beats[index]) / bound.beats[index]
        if several:
            turns[index] = (found.angles_deg[own] - angles[index]) / angle_bound[index]
    return Outcome(
        hits,
        beats,
        turns,
        len(free),
        solution.state.noise_precision / truth.noise_precision,
        solution.iterations,
    )


def noise_alarms(num_antennas, shape, rate, seeds):
    """Objects found in frames of noise alone, and the frames."""
    model = SignalModel(
        num_ramps=shape[0],
        num_samples=shape[1],
        sample_rate_hz=1e7,
        anti_aliasing_filter=NoFilter(),
        num_antennas=num_antennas,
    )
    estimator = ObjectOnlySeparator(model=model, false_alarm_rate=rate, max_iterations=8)
    found = 0
    for seed in seeds:
        rng = np.random.default_rng([seed, *shape, num_antennas])
        draws = rng.standard_normal((2, *model.rows_shape))
        found += run(estimator, draws[0] + 1j * draws[1]).objects.num_components
    return found


def _noise_rows(num_frames):
    for shape in ((1, 256), (16, 128)):
        for num_antennas in (1, 2, 4, 8):
            found = noise_alarms(num_antennas, shape, 0.05, range(num_frames))
            what = f"false alarms a frame of noise, {shape[0]} x {shape[1]}, 0.05 asked"
            yield what, num_antennas, "", poisson_interval(found, num_frames)


def _detection_rows(num_frames):
    for sir_db in (None, -20.0):
        label = "without interference" if sir_db is None else f"SIR {sir_db:g} dB"
        for one_db in (11.0, 12.0, 13.0, 14.0, 16.0):
            for num_antennas, snr_db in ((1, one_db), (4, one_db - 6.0), (4, one_db - 5.0)):
                hits = detections(num_antennas, snr_db, sir_db, range(num_frames))
                share = binomial_interval(hits, num_frames)
                yield f"detection, {label}", num_antennas, snr_db, share


def detections(num_antennas, snr_db, sir_db, seeds):
    """In how many frames of Simulation I the object is found; without a SIR nothing interferes."""
    runs = [
        separated(
            "simulation-1",
            num_antennas,
            snr_db=snr_db,
            sir_db=0.0 if sir_db is None else sir_db,
            seed=seed,
            interference=sir_db is not None,
        )
        for seed in seeds
    ]
    return sum(int(each.hits.sum()) for each in runs)


def _bound_rows(num_frames):
    for name, levels in (("simulation-1", (30.0, 24.0)), ("simulation-2-a", (60.0, 54.0))):
        for num_antennas, snr_db in zip((1, 4), levels, strict=True):
            runs = [
                separated(name, num_antennas, snr_db=snr_db, sir_db=-20.0, seed=seed)
                for seed in range(num_frames)
            ]
            where = num_antennas, snr_db
            misses = sum(int((~each.hits).sum()) for each in runs)
            alarms = sum(each.false_alarms for each in runs)
            yield f"misses a frame, {name}", *where, poisson_interval(misses, num_frames)
            yield f"false alarms a frame, {name}", *where, poisson_interval(alarms, num_frames)
            for kind in ("beat", "angle")[: 1 if num_antennas == 1 else 2]:
                errors = np.concatenate([getattr(each, f"{kind}_errors") for each in runs])
                errors = np.abs(errors[np.isfinite(errors)])
                rms = bootstrap_interval(errors, root_mean_square)
                yield f"{kind} RMSE over its bound, {name}", *where, rms
                middle = bootstrap_interval(errors, median)
                yield f"{kind} median error over its bound (0.674), {name}", *where, middle


def rows():
    """Yield the rows of the table."""
    figures = chain(_noise_rows(1500), _detection_rows(300), _bound_rows(100))
    for what, num_antennas, snr_db, found in figures:
        yield {
            "what": what,
            "antennas": num_antennas,
            "snr_db": snr_db,
            "value": found.value,
            "low": found.low,
            "high": found.high,
            "samples": found.num_samples,
        }


if __name__ == "__main__":
    write_table(Path(sys.argv[1]) / "antennas.csv", rows())
