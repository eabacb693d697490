"""Examples of single trials: signals (figures 2, 4, 6), time and frequency (1), maps (7 and 8).

Signals are not kept in rows. A trial is a pure function, so it is simply run again.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.state import SeparationState
from vsep.signal.spectra import delay_spectrum
from vsep.studies.catalogue import CATALOGUE
from vsep.studies.example_maps import map_panels, time_frequency_panels
from vsep.studies.panels import AnyPanel, FigurePanel, Series, SeriesKind
from vsep.studies.rows import trial_of_row
from vsep.studies.scenario import TrialScenario
from vsep.studies.study import ExampleKind
from vsep.studies.trial import DONE, Row, separate
from vsep.studies.trial_scenario import simulate_trial
from vsep.units import to_db

# What is this far below the strongest sample is not drawn.
_SHOWN_DB = 70.0


def example_panels(rows: Iterable[Row]) -> list[AnyPanel]:
    """Return the panels of every trial, of the first method that has a row of it.

    Parameters
    ----------
    rows : iterable of dict
        Rows of studies that show examples; those of others are passed over.

    Returns
    -------
    list of panels
        Signals are those of the ramp with the strongest burst.
    """
    panels: list[AnyPanel] = []
    seen = set()
    for row in rows:
        key = row["study"], row["point_index"], row["realization"]
        study = CATALOGUE.get(row["study"])
        if (
            study is not None
            and study.example is not None
            and row["status"] == DONE
            and key not in seen
        ):
            seen.add(key)
            panels += _panels_of(row, study.example)
    return panels


def _panels_of(row: Row, kind: ExampleKind) -> Sequence[AnyPanel]:
    trial = trial_of_row(row)
    drawn = simulate_trial(trial)
    if kind == "time-frequency":
        return time_frequency_panels(drawn)
    observation, solution = separate(trial, row["method"], drawn)
    if kind == "maps":
        return map_panels(trial, row["method"], drawn, solution)
    ramp = int(np.argmax(np.sum(np.abs(drawn.truth.interference_signal) ** 2, axis=1)))
    state = solution.state
    signals = {
        "received": observation.received[ramp],
        "interference estimate": state.interference_signal[ramp],
        "object estimate": state.object_signal[ramp],
        "true objects": drawn.truth.object_signal[ramp],
    }
    number = row["study"].removeprefix("fig-")
    levels = f"SNR {trial.point.snr_db:g} dB, SIR {trial.point.sir_db:g} dB"
    order = trial.point.butterworth_order
    mismatch = f", Butterworth order {order}" if order else ""
    title = f"Fig. {number}: {row['method']}, {levels}{mismatch}"
    return [_fast_time(title, drawn, signals, ramp), _delay(title, drawn, signals, state, ramp)]


def _fast_time(
    title: str, drawn: TrialScenario, signals: dict[str, ComplexArray], ramp: int
) -> FigurePanel:
    time_us = drawn.scenario.radar.sample_times_s * 1e6
    series = [
        _series(name, time_us, np.abs(signal) ** 2, _line_kind(name))
        for name, signal in signals.items()
    ]
    return _panel(title, "fast time [µs]", series, f"ramp {ramp}")


def _delay(
    title: str,
    drawn: TrialScenario,
    signals: dict[str, ComplexArray],
    state: SeparationState,
    ramp: int,
) -> FigurePanel:
    radar, truth = drawn.scenario.radar, drawn.truth
    series = []
    for name, signal in signals.items():
        beats, power = delay_spectrum(signal)
        series.append(_series(name, radar.range_from_beat(beats), power, _line_kind(name)))
    share = 1.0 / radar.num_ramps
    found = state.objects
    true_m, found_m = radar.range_from_beat(truth.beats), radar.range_from_beat(found.beats)
    series += [
        _series("true object", true_m, share * np.abs(truth.amplitudes) ** 2, "crosses"),
        _series("estimated object", found_m, share * np.abs(found.amplitudes) ** 2, "stems"),
    ]
    for burst in state.bursts_in(ramp):
        lines = burst.active_bins / drawn.model.num_grid_bins
        power = np.abs(burst.amplitudes) ** 2 / radar.num_samples
        series.append(_series("channel component", radar.range_from_beat(lines), power, "stems"))
    note = f"ramp {ramp}; levels of an object's spectral peak"
    return _panel(title, "range [m]", series, note)


def _line_kind(name: str) -> SeriesKind:
    """Truth is dashed, so that an estimate on it leaves it in sight."""
    return "dashed" if name.startswith("true") else "line"


def _series(name: str, x: FloatArray, power: FloatArray, kind: SeriesKind) -> Series:
    order = np.argsort(x)
    none = np.full(len(x), np.nan)
    level = np.asarray(to_db(power[order]), dtype=np.float64)
    return Series(label=name, role=name, kind=kind, x=x[order], y=level, low=none, high=none)


def _panel(title: str, x_label: str, series: list[Series], note: str) -> FigurePanel:
    """Lift what is far below the strongest value to one floor, where stems have their feet."""
    floor = max(float(one.y.max(initial=-np.inf)) for one in series) - _SHOWN_DB
    lifted = tuple(
        replace(one, y=np.maximum(one.y, floor), low=np.full(len(one.x), floor))
        for one in series
        if len(one.x)
    )
    return FigurePanel(title=title, x_label=x_label, y_label="level [dB]", series=lifted, note=note)
