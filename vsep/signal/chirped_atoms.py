"""Atoms of objects that accelerate: the Doppler frequency changes within the frame.

In ramp p, counted from the middle of the frame as p', the phase is ``-2 pi (doppler p + curvature
p'^2)``: the Doppler frequency in mid-frame is `doppler`; it changes by ``2 curvature`` from ramp to
ramp, by ``2 curvature P^2`` cells within the frame. The atom is separable as every other.
"""

from typing import NamedTuple

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.atoms import line_factors

MAX_SWEEP_CELLS = 4.0
_GRID_CELLS = 0.25
_STEPS = 12


class ChirpedPoint(NamedTuple):
    """Frequencies of an atom; cycles a sample, a ramp and a ramp squared."""

    beat: float
    doppler: float
    curvature: float


def middle(num_ramps: int) -> FloatArray:
    """(P,) ramps counted from the middle of the frame."""
    return np.asarray(np.arange(num_ramps) - 0.5 * (num_ramps - 1))


def chirped_factors(dopplers: FloatArray, curvatures: FloatArray, num_ramps: int) -> ComplexArray:
    """Factors (L, P) along the ramps of atoms that accelerate, of unit norm.

    Examples
    --------
    >>> import numpy as np
    >>> factor = chirped_factors(np.array([0.1]), np.array([1e-4]), 64)[0]
    >>> bool(np.isclose(np.linalg.norm(factor), 1.0))
    True
    """
    turns = np.exp(-2j * np.pi * curvatures[:, None] * middle(num_ramps) ** 2)
    return np.asarray(line_factors(dopplers, num_ramps) * turns)


def chirped_signals(
    points: FloatArray, amplitudes: ComplexArray, shape: tuple[int, int]
) -> ComplexArray:
    """Signals (L, A, P, N) of atoms at points (L, 3) with weights (L, A)."""
    along = chirped_factors(points[:, 1], points[:, 2], shape[0])
    across = line_factors(points[:, 0], shape[1])
    return np.asarray(
        amplitudes[:, :, None, None] * along[:, None, :, None] * across[:, None, None, :]
    )


def chirped_products(point: ChirpedPoint, signals: ComplexArray) -> ComplexArray:
    """Inner products (A,) of an atom with signals (A, P, N)."""
    return np.asarray(_moments(point, signals)[0])


def curvature_power(point: ChirpedPoint, residual: ComplexArray) -> float:
    """Power of a residual (A, P, N) that a small curvature of an atom would explain."""
    square = float(residual.shape[1]) ** 2
    variance = (square - 1.0) * (square - 4.0) / 180.0
    return float(np.sum(abs(_moments(point, residual)[3]) ** 2)) / variance


def _moments(point: ChirpedPoint, signals: ComplexArray) -> ComplexArray:
    """(10, A) inner products: value, first and second derivatives, by beat, Doppler, curvature.

    Derivatives over j 2 pi: 1, n, p, q, nn, np, nq, pp, pq, qq with n and p from the middle and
    q the square of p less its mean, so that they are orthogonal to the atom.
    """
    num_ramps, num_samples = signals.shape[1:]
    n, p = middle(num_samples), middle(num_ramps)
    q = p**2 - np.mean(p**2)
    across = line_factors(np.array([point.beat]), num_samples)[0].conj()
    along = chirped_factors(np.array([point.doppler]), np.array([point.curvature]), num_ramps)[0]
    columns = np.stack([across, n * across, n**2 * across], axis=1)
    zeroth, first, second = np.moveaxis(signals @ columns * along.conj()[:, None], 2, 0)
    weighed = [zeroth, first, p * zeroth, q * zeroth, second, p * first, q * first]
    weighed += [p**2 * zeroth, p * q * zeroth, q**2 * zeroth]
    return np.stack([each.sum(axis=1) for each in weighed])


def refined(point: ChirpedPoint, signals: ComplexArray) -> ChirpedPoint:
    """Maximise what an atom explains of signals (A, P, N), by Newton steps that never lose."""
    scale = np.array([signals.shape[2], signals.shape[1], signals.shape[1] ** 2], dtype=np.float64)
    place = np.array(point)
    best, gradient, hessian = _power_jet(point, signals)
    for _ in range(_STEPS):
        curved = hessian / np.outer(scale, scale)
        lowest = float(np.linalg.eigvalsh(curved)[-1])
        if lowest > 0.0:  # not concave: a step along the gradient
            curved = curved - 1.5 * lowest * np.eye(3)
        step = -np.linalg.solve(curved, gradient / scale)
        step *= min(1.0, 0.25 / max(float(abs(step).max()), 1e-300))
        for _ in range(4):
            trial = ChirpedPoint(*(place + step / scale))
            power, next_gradient, next_hessian = _power_jet(trial, signals)
            if power >= best:
                break
            step = 0.25 * step
        else:
            break
        gained, best = power - best, power
        place, gradient, hessian = np.array(trial), next_gradient, next_hessian
        if gained <= 1e-12 * best:
            break
    return ChirpedPoint(*(float(each) for each in place))


def _power_jet(point: ChirpedPoint, signals: ComplexArray) -> tuple[float, FloatArray, FloatArray]:
    """Explained power sum |phi^H r|^2, its gradient and Hessian by the three frequencies."""
    value, *products = _moments(point, signals)
    first = 2j * np.pi * np.stack(products[:3])
    second = -4.0 * np.pi**2 * np.stack(products[3:])
    order = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
    gradient = 2.0 * np.real(first @ value.conj())
    hessian = 2.0 * np.real(first @ first.conj().T + (second @ value.conj())[order])
    return float(np.sum(abs(value) ** 2)), gradient, hessian


def best_chirped_point(
    beat: float, doppler: float, signals: ComplexArray, reach_cells: float
) -> ChirpedPoint:
    """Find the atom that explains most of signals (A, P, N) around a beat and a Doppler frequency.

    Parameters
    ----------
    beat, doppler : float
        Where to look.
    signals : (A, P, N) complex
        What to explain.
    reach_cells : float
        How far its Doppler frequency may be from that.
    """
    num_ramps = signals.shape[1]
    sweeps = np.arange(-MAX_SWEEP_CELLS, MAX_SWEEP_CELLS + 0.5 * _GRID_CELLS, _GRID_CELLS)
    curvatures = sweeps / (2.0 * num_ramps**2)
    along = signals @ line_factors(np.array([beat]), signals.shape[2])[0].conj()
    ramps = np.arange(num_ramps)
    turns = curvatures[:, None] * middle(num_ramps) ** 2 + doppler * ramps
    turned = along[:, None] * np.exp(2j * np.pi * turns)
    powers = np.sum(abs(fft.ifft(turned, 4 * num_ramps, axis=2)) ** 2, axis=0)
    offsets = fft.fftfreq(4 * num_ramps)
    powers[:, abs(offsets) * num_ramps > reach_cells] = 0.0
    row, column = np.unravel_index(int(np.argmax(powers)), powers.shape)
    start = ChirpedPoint(beat, doppler + float(offsets[column]), float(curvatures[row]))
    return refined(start, signals)
