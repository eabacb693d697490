"""What unknown interference costs the objects of Figure 5d, and which bound explains it.

As a script it writes the table and the figure of `assets/docs/results.md`:

    python -m tests.vsep.interference_cost assets/results
"""

import sys
from pathlib import Path

import numpy as np

from tests.vsep.result_tables import write_table
from vsep.analysis.burst_model import Burst
from vsep.analysis.crlb import (
    _as_real,
    _burst_columns,
    _object_columns,
    _orthonormal,
    _unit_length,
    _without,
    dispersion_bound,
)
from vsep.analysis.metrics import expected_errors, frame_errors
from vsep.studies.catalogue import make_study
from vsep.studies.trial import separate
from vsep.studies.trial_scenario import simulate_trial

METHODS = ("factorised", "no-interference")
POINTS = {15: 200, 23: 100}  # of the study fig-5, SIR -40 and 0 dB: realisations
RATIOS = (
    ("measured, all frames", "error", "clean_error"),
    ("measured, frames of one order", "error", "clean_error"),
    ("bound, paths of the truth", "bound_of_truth", "clean_bound"),
    ("bound, components as estimated", "bound_of_estimate", "clean_bound"),
    ("the frame's noise outside of these components", "outside", "inside"),
)


def first_order_errors(noise, truth, model, bursts=()):
    """(L,) errors by least squares of the noise, with the span of the bursts taken out."""
    atoms, moved = _object_columns(truth, model)
    columns = np.concatenate([atoms, 1j * atoms, moved])
    noise = noise.copy()[None]
    for ramp in {burst.ramp for burst in bursts}:
        own = [_burst_columns(burst, model) for burst in bursts if burst.ramp == ramp]
        basis = _orthonormal(np.concatenate(own))
        for block in (columns, noise):
            block[:, ramp] = _without(basis, block[:, ramp])
    scaled, lengths = _unit_length(_as_real(columns))
    weights = np.linalg.lstsq(scaled.T, _as_real(noise)[0], rcond=1e-10)[0] / lengths
    beats, dopplers = weights[2 * len(atoms) :].reshape(2, -1)
    return np.hypot(beats, dopplers)


def compared(index, realization):
    """Errors of the objects that both methods find, and what bounds expect; None beside ten."""
    trial = make_study("fig-5", methods=METHODS).trial(index, realization)
    drawn = simulate_trial(trial)
    truth, model = drawn.truth, drawn.model
    if len(truth.beats) != 10:
        return None
    unknown, known = drawn.bounds()
    row = {"bound_of_truth": expected_errors(unknown), "clean_bound": expected_errors(known)}
    counts = []
    for method, name in zip(METHODS, ("error", "clean_error"), strict=True):
        observation, solution = separate(trial, method, drawn)
        objects = solution.objects
        found = frame_errors(
            np.stack([truth.beats, truth.dopplers], 1),
            np.stack([objects.beats, objects.dopplers], 1),
            model.shape,
        )
        row[name] = np.full(10, np.nan)
        row[name][found.gospa.true_indices] = found.errors
        counts.append(objects.num_components)
        if method == METHODS[0]:
            bursts = [
                Burst(
                    ramp=burst.ramp,
                    start_frequency=burst.start_frequency,
                    slope=burst.slope,
                    channel_frequencies=burst.active_bins / (2 * model.num_samples),
                    amplitudes=burst.amplitudes,
                )
                for burst in solution.state.bursts
                if burst.num_components
            ]
            noise = observation.received - truth.object_signal - truth.interference_signal
    row["bound_of_estimate"] = expected_errors(dispersion_bound(truth, model, bursts))
    row["inside"] = first_order_errors(noise, truth, model)
    row["outside"] = first_order_errors(noise, truth, model, bursts)
    both = np.isfinite(row["error"]) & np.isfinite(row["clean_error"])
    is_same = counts[0] == counts[1] and both.sum() == np.isfinite(row["error"]).sum()
    sums = {name: float(values[both].sum()) for name, values in row.items()}
    return sums | {"same": float(is_same)}


def ratios(frames):
    """Yield what, number of frames, ratio of sums over frames, and its 95 % interval."""
    rng = np.random.default_rng(0)
    for what, upper, lower in RATIOS:
        chosen = frames if "all" in what else [frame for frame in frames if frame["same"]]
        pairs = np.array([(frame[upper], frame[lower]) for frame in chosen])
        again = pairs[rng.integers(0, len(pairs), (2000, len(pairs)))].sum(axis=1)
        low, high = np.quantile(again[:, 0] / again[:, 1], [0.025, 0.975])
        yield what, len(chosen), float(np.divide(*pairs.sum(axis=0))), float(low), float(high)


def rows_of(index):
    """Rows of the table at one point."""
    frames = [compared(index, realization) for realization in range(POINTS[index])]
    sir_db = make_study("fig-5").points[index].sir_db
    return [
        {
            "sir_db": sir_db,
            "ratio_to_no_interference": what,
            "frames": count,
            "value": value,
            "low": low,
            "high": high,
        }
        for what, count, value, low, high in ratios([row for row in frames if row])
    ]


def main(folder):
    """Write the table and the figure."""
    tables = [rows_of(index) for index in POINTS]
    write_table(folder / "interference-cost.csv", [row for rows in tables for row in rows])
    draw(folder / "interference-cost.png", tables)


def draw(path, tables):
    """Draw the rows of every point."""
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(7.2, 3.0), layout="constrained")
    for place, rows in enumerate(tables):
        values, low, high = np.array([(row["value"], row["low"], row["high"]) for row in rows]).T
        places = np.arange(len(rows)) + 0.2 * place
        reach = [values - low, high - values]
        label = f"{rows[0]['sir_db']:g} dB"
        axis.errorbar(values, -places, xerr=reach, fmt="os"[place], label=label)
    axis.axvline(1.0, color="grey", linewidth=0.8)
    axis.set_yticks(-np.arange(len(RATIOS)), [what for what, *_ in RATIOS])
    axis.set_xlabel("mean error to that without interference")
    axis.legend(title="SIR", loc="center right")
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
