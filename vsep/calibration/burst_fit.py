"""Least-squares fit of one burst: crossing time, slope and gains for a given response.

The gains of all antennas are linear and projected out; what is left is fitted by Gauss-Newton
steps in the crossing time, and in the slope where that is free.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.calibration.burst_windows import BurstWindow
from vsep.calibration.line_grid import LineGrid

START_OFFSETS = np.arange(-3.0, 3.1, 0.5)  # samples around the search's crossing, tried at first
MAX_MOVE = 0.5  # samples, one step
MAX_STRETCH = 0.01  # of the slope, one step
HALVINGS = 6


@dataclass(frozen=True, slots=True, eq=False)
class BurstFit:
    """Least-squares fit of a response to one burst."""

    crossing: float  #: sample of the ramp at which the chirp crosses zero frequency
    slope_hz_per_s: float
    gains: ComplexArray  #: (A,)
    errors: FloatArray  #: (A,) residual energy over the energy of the window, the burst's NMSE


def start_fit(
    window: BurstWindow, response: ComplexArray, grid: LineGrid, slope_hz_per_s: float
) -> BurstFit:
    """Best of a few crossing times around that of the search."""
    trials = (
        evaluate(window, response, grid, window.crossing + offset, slope_hz_per_s)
        for offset in START_OFFSETS
    )
    return min(trials, key=lambda fit: float(fit.errors.mean()))


def evaluate(
    window: BurstWindow,
    response: ComplexArray,
    grid: LineGrid,
    crossing: float,
    slope_hz_per_s: float,
) -> BurstFit:
    """Gains and errors of a response (A, K) at a crossing time and slope."""
    values = response * _chirp(window, grid, crossing, slope_hz_per_s)
    templates = grid.synthesize(values, _first(window), window.signals.shape[1])
    energy = np.sum(np.abs(templates) ** 2, axis=1)
    gains = np.sum(templates.conj() * window.signals, axis=1) / np.where(energy > 0.0, energy, 1.0)
    residual = np.abs(window.signals - gains[:, None] * templates) ** 2
    errors = np.sum(residual, axis=1) / np.sum(np.abs(window.signals) ** 2, axis=1)
    return BurstFit(crossing, slope_hz_per_s, gains, errors)


def refine_fit(
    window: BurstWindow,
    response: ComplexArray,
    grid: LineGrid,
    fit: BurstFit,
    *,
    free_slope: bool,
    steps: int,
) -> BurstFit:
    """Least squares in the crossing time, and in the slope if it is free; the error never grows."""
    for _ in range(steps):
        move = _step(window, response, grid, fit)[: 2 if free_slope else 1]
        limits = np.array([MAX_MOVE, MAX_STRETCH * abs(fit.slope_hz_per_s)])[: len(move)]
        move = move / max(1.0, float(np.max(np.abs(move) / limits)))
        for _ in range(HALVINGS):
            stretch = float(move[1]) if free_slope else 0.0
            trial = evaluate(
                window, response, grid, fit.crossing + move[0], fit.slope_hz_per_s + stretch
            )
            if trial.errors.sum() < fit.errors.sum():
                fit = trial
                break
            move = 0.25 * move
        else:
            break
    return fit


def _step(window: BurstWindow, response: ComplexArray, grid: LineGrid, fit: BurstFit) -> FloatArray:
    """Gauss-Newton step in crossing time and slope; for the crossing alone, its first element.

    The two directions are made orthogonal by the slope's: at the band's centre they nearly are.
    """
    values = response * _chirp(window, grid, fit.crossing, fit.slope_hz_per_s)
    by_crossing = -2j * np.pi * grid.lines / grid.size
    by_slope = 1j * np.pi * grid.frequency_hz**2 / fit.slope_hz_per_s**2
    stacked = np.stack([values, values * by_crossing, values * by_slope])
    length = window.signals.shape[1]
    templates, *derivatives = grid.synthesize(stacked, _first(window), length)
    energy = np.maximum(np.sum(np.abs(templates) ** 2, axis=1, keepdims=True), 1e-300)
    # Antennas count by the share of their energy, as in the errors.
    weight = 1.0 / np.sqrt(np.sum(np.abs(window.signals) ** 2, axis=1, keepdims=True))
    columns = []
    for derivative in derivatives:
        moved = fit.gains[:, None] * derivative
        inside = np.sum(templates.conj() * moved, axis=1, keepdims=True) / energy
        columns.append((weight * (moved - inside * templates)).ravel())
    residual = (weight * (window.signals - fit.gains[:, None] * templates)).ravel()
    normal = np.array([[np.vdot(a, b).real for b in columns] for a in columns])
    gradient = np.array([np.vdot(column, residual).real for column in columns])
    scale = np.sqrt(np.diagonal(normal))
    normal = normal / np.outer(scale, scale) + 1e-9 * np.eye(2)
    return np.asarray(np.linalg.solve(normal, gradient / scale) / scale)


def _chirp(
    window: BurstWindow, grid: LineGrid, crossing: float, slope_hz_per_s: float
) -> ComplexArray:
    """Spectrum of the chirp relative to the whole sample next to the window's crossing."""
    return grid.chirp(crossing - reference(window), slope_hz_per_s)


def reference(window: BurstWindow) -> int:
    """Sample that counts as zero for the lines of a window."""
    return round(window.crossing)


def _first(window: BurstWindow) -> int:
    return window.first - reference(window)
