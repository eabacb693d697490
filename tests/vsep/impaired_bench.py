"""Weak objects under bursts that no model explains: clipped, switched in the band, misfiltered.

As a script it writes the table of `assets/docs/mitigation.md`:

    python -m tests.vsep.impaired_bench assets/results
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.vsep.noise_bench import FILTER, model_of, nearest
from tests.vsep.result_tables import write_table
from vsep.analysis.intervals import binomial_interval, bootstrap_interval, mean
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.deviations import state_deviations
from vsep.inference.evidence_choice import Choice
from vsep.inference.registry import make_estimator
from vsep.mitigation.masks.detectors import detect_interference
from vsep.signal.filters import ButterworthFilter
from vsep.units import wrap_frequency

SHAPE = 32, 256
MODEL = model_of(*SHAPE)
NUM_OBJECTS, SNR_DB = 30, (10.0, 22.0)
OVERSAMPLED = 8


@dataclass(frozen=True)
class Bursts:
    """Bursts of about this length in samples and level over the noise, and what is wrong."""

    length: float = 30.0
    level_db: float = 40.0
    share_of_ramps: float = 0.5
    number: int = 1  #: in such a ramp
    switched: bool = False
    clipped: bool = False
    anti_aliasing_filter: object = FILTER


IMPAIRED = {
    "matched": Bursts(),
    "clipped": Bursts(clipped=True),
    "switched on or off in the band": Bursts(level_db=60.0, switched=True),
    "through another filter": Bursts(
        anti_aliasing_filter=ButterworthFilter(cutoff_hz=2.5e6, order=6)
    ),
    "long": Bursts(length=150.0),
    "in every ramp": Bursts(share_of_ramps=1.0),
    "switched, in every ramp": Bursts(level_db=60.0, switched=True, share_of_ramps=1.0),
}
MANY = {
    "four in every ramp": Bursts(share_of_ramps=1.0, number=4),
    "four in half of the ramps": Bursts(number=4),
    "of four samples": Bursts(length=4.0, share_of_ramps=1.0),
}
FRAMES = 20
SEED = 20_608
DETECTED = ("autoregressive", "residual")


def scene(bursts, seed):
    """Points (30, 2) of the objects, and the frame with bursts and noise."""
    rng = np.random.default_rng(seed)
    points = separated_points(rng)
    received = rng.standard_normal((2, *SHAPE)) / np.sqrt(2.0)
    received = received[0] + 1j * received[1]
    ramps, samples = np.arange(SHAPE[0])[:, None], np.arange(SHAPE[1])
    for beat, doppler in points:
        level = 10.0 ** (rng.uniform(*SNR_DB) / 10.0) / received.size
        phase = rng.uniform() + beat * samples + doppler * ramps
        received += np.sqrt(level) * np.exp(-2j * np.pi * phase)
    for ramp in range(SHAPE[0]):
        if rng.uniform() < bursts.share_of_ramps:
            for _ in range(bursts.number):
                received[ramp] += burst(bursts, rng)
    if bursts.clipped:
        limit = 0.5 * 10.0 ** (bursts.level_db / 20.0)
        received = np.clip(received.real, -limit, limit) + 1j * np.clip(
            received.imag, -limit, limit
        )
    return points, received


def missed(objects, points):
    """Points without an object within a cell."""
    if objects.num_components == 0:
        return len(points)
    found = np.column_stack([objects.beats, objects.dopplers])
    cells = np.abs(wrap_frequency(found[:, None] - points[None])) * SHAPE[::-1]
    return int(np.sum(cells.max(axis=2).min(axis=0) > 1.0))


def ghosts(objects, points):
    """Objects without a point within a cell."""
    found = np.column_stack([objects.beats, objects.dopplers])
    cells = np.abs(wrap_frequency(found[:, None] - points[None])) * SHAPE[::-1]
    return int(np.sum(cells.max(axis=2).min(axis=1) > 1.0))


def separated_points(rng):
    points = np.empty((0, 2))
    while len(points) < NUM_OBJECTS:
        point = np.array([rng.uniform(-0.24, 0.24), rng.uniform(-0.5, 0.5)])
        cells = np.abs(wrap_frequency(points - point)) * SHAPE[::-1]
        if not len(points) or np.all(cells.max(axis=1) > 3.0):
            points = np.vstack([points, point])
    return points


def burst(bursts, rng):
    """One chirp of two to three paths through the receiver's filter, exactly."""
    size = 3 * SHAPE[1] * OVERSAMPLED
    time = (np.arange(size) - SHAPE[1] * OVERSAMPLED) / OVERSAMPLED  # in samples
    slope = rng.choice([-1.0, 1.0]) * 0.5 / (bursts.length * rng.uniform(0.7, 1.4))
    centre = rng.uniform(10.0, SHAPE[1] - 10.0)
    in_front = np.abs(slope * (time - centre)) < 3.5
    course = np.zeros(size, dtype=np.complex128)
    for path in range(3):
        weight = (1.0 if path == 0 else 0.3 * rng.uniform()) * np.exp(2j * np.pi * rng.uniform())
        delayed = 0.0 if path == 0 else rng.uniform(-0.01, 0.01) * time
        cycles = 0.5 * slope * (time - centre) ** 2 + delayed
        course += weight * np.where(in_front, np.exp(2j * np.pi * cycles), 0.0)
    if bursts.switched:
        edge = centre + rng.uniform(-0.4, 0.4) * bursts.length
        course *= (time > edge) if rng.uniform() < 0.5 else (time < edge)
    frequency_hz = np.fft.fftfreq(size) * OVERSAMPLED * 1e7
    response = bursts.anti_aliasing_filter.response(frequency_hz)
    filtered = np.fft.ifft(np.fft.fft(course) * response)
    inside = slice(SHAPE[1] * OVERSAMPLED, 2 * SHAPE[1] * OVERSAMPLED, OVERSAMPLED)
    level_db = bursts.level_db + rng.uniform(-6.0, 3.0)
    return filtered[inside] * 10.0 ** (level_db / 20.0)


def within_deviations(state, points):
    """Errors of beat and Doppler of the objects found, in their standard deviations."""
    deviations = state_deviations(state, SHAPE)
    found = [nearest(state.objects, point, SHAPE) for point in points]
    return [
        error / deviation
        for match in found
        if match is not None
        for error, deviation in zip(
            match[1],
            (deviations.beats[match[0]], deviations.dopplers[match[0]]),
            strict=True,
        )
    ]


def runs_of(name, seed):
    """Runs of a frame by what was done with its bursts, and its points."""
    points, received = scene(IMPAIRED[name], [SEED, seed])
    runs = {each: run(make_estimator(each, MODEL), received) for each in ("factorised", "evidence")}
    for detector in DETECTED:
        mask = detect_interference(detector, received)
        runs[detector] = run(make_estimator("masked", MODEL, mask=mask), received)
    return points, runs


def row_of(name, frames=FRAMES):
    """Row of the table: means over the frames with 95 % intervals."""
    results = [runs_of(name, seed) for seed in range(frames)]
    misses = {
        each: np.array([missed(runs[each].objects, points) for points, runs in results], float)
        for each in results[0][1]
    }
    row = {"bursts": name, "frames": frames}
    for each, values in misses.items():
        row[f"missed_{each}"] = values.mean()
    for other in ("factorised", *DETECTED):
        interval = bootstrap_interval(misses["evidence"] - misses[other], mean)
        row[f"more_than_{other}"] = (misses["evidence"] - misses[other]).mean()
        row[f"more_than_{other}_low"], row[f"more_than_{other}_high"] = interval.low, interval.high
    chosen = [(points, runs["evidence"]) for points, runs in results]
    row["ghosts_factorised"] = np.mean([ghosts(r["factorised"].objects, p) for p, r in results])
    row["ghosts_evidence"] = np.mean([ghosts(solution.objects, p) for p, solution in chosen])
    row["separation_kept"] = np.mean([s.state.choice is Choice.SEPARATION for _, s in chosen])
    row["converged"] = np.mean([s.termination is Termination.CONVERGED for _, s in chosen])
    errors = np.abs(np.concatenate([within_deviations(s.state, p) for p, s in chosen]))
    for deviations in (1, 2):
        inside = int(np.sum(errors < deviations))
        interval = binomial_interval(inside, len(errors))
        row[f"within_{deviations}"] = inside / len(errors)
        row[f"within_{deviations}_low"] = interval.low
        row[f"within_{deviations}_high"] = interval.high
    return row


if __name__ == "__main__":
    write_table(Path(sys.argv[1]) / "impaired-bursts.csv", map(row_of, IMPAIRED))
