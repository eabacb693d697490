"""Pictures of single trials: time and frequency (Fig. 1c, 1d), range-Doppler maps (Fig. 7, 8)."""

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.analysis.metrics import frame_errors
from vsep.inference.core.progress import Solution
from vsep.inference.core.run import run
from vsep.inference.core.state import ObjectComponents
from vsep.signal.radar import ChirpSequence
from vsep.signal.spectra import hann_window, range_doppler_map
from vsep.studies.methods import trial_estimator
from vsep.studies.panels import AnyPanel, FigurePanel, ImagePanel, Series, SeriesKind
from vsep.studies.scenario import TrialScenario
from vsep.studies.study import Trial
from vsep.units import to_db

_WINDOW, _PADDING = 32, 4  # samples of a short-time spectrum, and its bins over them
_SHOWN_DB = 60.0  # below the strongest level


def time_frequency_panels(drawn: TrialScenario) -> list[AnyPanel]:
    """Return Fig. 1c to 1e: objects and interference over time and frequency, and their levels."""
    radar, truth = drawn.scenario.radar, drawn.truth
    ramp = strongest_ramp(drawn)
    title = "Fig. 1: intermediate frequency over fast time, and the signals of one ramp"
    signals = {
        "true objects": truth.object_signal[ramp],
        "received": drawn.interfered.received[ramp],
        "interference estimate": truth.interference_signal[ramp],
    }
    pictures: list[AnyPanel] = [
        _short_time_panel(title, radar, signals[name], f"({letter}) {what}, ramp {ramp}")
        for letter, name, what in (
            ("c", "true objects", "objects"),
            ("d", "interference estimate", "interference"),
        )
    ]
    labels = {"interference estimate": "interference", "true objects": "objects"}
    lines = FigurePanel(
        title=title,
        x_label="fast time [µs]",
        y_label="level [dB]",
        series=tuple(
            _line(labels.get(name, name), name, radar.sample_times_s * 1e6, signal)
            for name, signal in signals.items()
        ),
        note=f"(e) ramp {ramp}",
    )
    return [*pictures, lines]


def strongest_ramp(drawn: TrialScenario) -> int:
    """Return the ramp with the strongest bursts."""
    return int(np.argmax(np.sum(np.abs(drawn.truth.interference_signal) ** 2, axis=1)))


def _short_time_panel(
    title: str, radar: ChirpSequence, signal: ComplexArray, note: str
) -> ImagePanel:
    pieces = np.lib.stride_tricks.sliding_window_view(signal, _WINDOW)
    bins = np.fft.fftshift(
        np.fft.ifft(pieces * hann_window(_WINDOW), n=_PADDING * _WINDOW, axis=1), axes=1
    )
    frequencies = np.fft.fftshift(np.fft.fftfreq(bins.shape[1])) * radar.sample_rate_hz
    middles = (np.arange(len(pieces)) + 0.5 * (_WINDOW - 1)) / radar.sample_rate_hz
    return ImagePanel(
        title=title,
        x_label="fast time [µs]",
        y_label="intermediate frequency [MHz]",
        x=np.asarray(middles * 1e6, dtype=np.float64),
        y=frequencies * 1e-6,
        levels_db=_levels(np.abs(bins.T) ** 2),
        note=note,
    )


def map_panels(
    trial: Trial, method: str, drawn: TrialScenario, solution: Solution
) -> list[AnyPanel]:
    """Return Fig. 7: maps without and with bursts and of the cleaned frame, and Fig. 8 of one ramp.

    Misses and false alarms count against what is found in the frame without bursts.
    """
    found, received = solution.objects, drawn.interfered.received
    estimator = trial_estimator(
        "object-only",
        drawn.model,
        trial.point,
        trial.settings,
        max_iterations=drawn.max_iterations,
    )
    untreated = run(estimator, received).objects
    cleaned = solution.state.cleaned(received)
    title = f"Fig. 7: {trial.point.scene}, SIR {trial.point.sir_db:g} dB, {method}"
    pictures: list[AnyPanel] = [
        _map(title, drawn, frame, objects, note)
        for frame, objects, note in (
            (drawn.clean.received, None, "(b) without bursts"),
            (received, untreated, "(c) with bursts, nothing done"),
            (cleaned, found, f"(d) cleaned, {method}"),
        )
    ]
    ramp, radar = strongest_ramp(drawn), drawn.scenario.radar
    times = radar.sample_times_s * 1e6
    lines = FigurePanel(
        title=f"Fig. 8: one ramp, {method}",
        x_label="fast time [µs]",
        y_label="level [dB]",
        series=(
            _line("received", "received", times, received[ramp]),
            _line("mitigated", "mitigated", times, cleaned[ramp]),
            _line("object estimate", "object estimate", times, solution.state.object_signal[ramp]),
        ),
        note=f"ramp {ramp}",
    )
    return [*pictures, lines]


def _map(
    title: str,
    drawn: TrialScenario,
    frame: ComplexArray,
    objects: ObjectComponents | None,
    note: str,
) -> ImagePanel:
    radar, truth = drawn.scenario.radar, drawn.truth
    picture = range_doppler_map(frame, 2, "hann", lowest_beat=radar.lowest_beat)
    ranges, velocities = (
        radar.range_from_beat(picture.beats),
        radar.velocity_from_doppler(picture.dopplers),
    )
    true = np.stack([truth.beats, truth.dopplers], axis=1)
    series = []
    if objects is None:
        series.append(_marks("detections", "detection", radar, true, "stems"))
    else:
        found = np.stack([objects.beats, objects.dopplers], axis=1)
        errors = frame_errors(true, found, (radar.num_ramps, radar.num_samples))
        hit = np.isin(np.arange(len(found)), errors.found_indices)
        missed = ~np.isin(np.arange(len(true)), errors.gospa.true_indices)
        groups: tuple[tuple[str, str, FloatArray, SeriesKind], ...] = (
            ("detections", "detection", found[hit], "stems"),
            ("false alarms", "false estimate", found[~hit], "stems"),
            ("missed", "true object", true[missed], "crosses"),
        )
        for label, role, points, kind in groups:
            if len(points):
                series.append(_marks(f"{len(points)} {label}", role, radar, points, kind))
    order = np.argsort(velocities)
    return ImagePanel(
        title=title,
        x_label="range [m]",
        y_label="radial velocity [m/s]",
        x=ranges,
        y=velocities[order],
        levels_db=_levels(picture.power[order]),
        series=tuple(series),
        note=note,
    )


def _marks(
    label: str, role: str, radar: ChirpSequence, points: FloatArray, kind: SeriesKind
) -> Series:
    """Rings and crosses in a map: stems without a foot."""
    x, y = radar.range_from_beat(points[:, 0]), radar.velocity_from_doppler(points[:, 1])
    return Series(label=label, role=role, kind=kind, x=x, y=y, low=y, high=y)


def _line(label: str, role: str, x: FloatArray, signal: ComplexArray) -> Series:
    none = np.full(len(x), np.nan)
    levels = _levels(np.abs(signal) ** 2)
    return Series(label=label, role=role, kind="line", x=x, y=levels, low=none, high=none)


def _levels(power: FloatArray) -> FloatArray:
    """Levels in dB, lifted to a floor below the strongest one."""
    peak = float(power.max())
    floor = (peak if peak > 0.0 else 1.0) * 10.0 ** (-0.1 * _SHOWN_DB)
    return np.asarray(to_db(np.maximum(power, floor)), dtype=np.float64)
