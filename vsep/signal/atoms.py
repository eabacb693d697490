"""Object atoms (10): unit-norm two-dimensional complex exponentials and products with them.

An atom is a Kronecker product, so it is kept as its two factors: nothing of size PN x L is made.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.line_spectra import BEAT_ORDERS, DOPPLER_ORDERS, fill_lines
from vsep.kernels.moving_atoms import STATIONARY
from vsep.signal.dithered_atoms import Coupling, RampDither


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class DispersionStd:
    """Standard deviations of the objects' frequencies.

    Attributes
    ----------
    beats : (L,) float
        Cycles per sample.
    dopplers : (L,) float
        Cycles per ramp; infinite for a single ramp, where Doppler is not observable.
    """

    beats: FloatArray
    dopplers: FloatArray


def line_factors(frequencies: FloatArray, length: int) -> ComplexArray:
    """Unit-norm exponentials ``exp(-j 2 pi f m) / sqrt(length)``, one row a frequency.

    Parameters
    ----------
    frequencies : (L,) float
        Normalised frequencies, cycles per step.
    length : int
        Number of steps M.

    Returns
    -------
    (L, M) complex

    Examples
    --------
    >>> import numpy as np
    >>> np.round(line_factors(np.array([0.25]), 4) * 2)
    array([[ 1.+0.j,  0.-1.j, -1.-0.j, -0.+1.j]])
    """
    lines = np.empty((len(frequencies), length), dtype=np.complex128)
    fill_lines(np.array(frequencies, dtype=np.float64), lines)
    return lines


def line_slopes(lines: ComplexArray) -> ComplexArray:
    """Differentiate unit-norm lines (L, M) by their frequencies, phase standing still mid-way.

    Which sample the phase stands still at is free (the weights absorb it); the middle makes the
    derivative orthogonal to the line.
    """
    length = lines.shape[1]
    return np.asarray(-2j * np.pi * (np.arange(length) - 0.5 * (length - 1)) * lines)


def synthesize(
    amplitudes: ComplexArray, beat_factors: ComplexArray, doppler_factors: ComplexArray
) -> ComplexArray:
    """Object signal Phi alpha as a (P, N) array from (L, N) and (L, P) factors."""
    return np.asarray((doppler_factors * amplitudes[:, None]).T @ beat_factors)


def project(
    signal: ComplexArray, beat_factors: ComplexArray, doppler_factors: ComplexArray
) -> ComplexArray:
    """Adjoint Phi^H r: (L,) inner products of a (P, N) signal with every atom."""
    along_ramps = signal @ beat_factors.conj().T
    return np.asarray((doppler_factors.conj() * along_ramps.T).sum(axis=1))


def gram(beat_factors: ComplexArray, doppler_factors: ComplexArray) -> ComplexArray:
    """Gram matrix Phi^H Phi, (L, L): the product of two Dirichlet kernels."""
    return np.asarray(
        (beat_factors.conj() @ beat_factors.T) * (doppler_factors.conj() @ doppler_factors.T)
    )


Factors = tuple[ComplexArray, ComplexArray]


def gram_between(columns: Factors, others: Factors) -> ComplexArray:
    """Inner products (L, M) of L separable columns with M other ones."""
    return np.asarray((columns[0].conj() @ others[0].T) * (columns[1].conj() @ others[1].T))


def moved_atoms(factors: Factors, amplitudes: ComplexArray) -> Factors:
    """Differentiate weighted atoms by all beats, then (for several ramps) by all Dopplers.

    Parameters
    ----------
    factors : tuple of (L, N) and (L, P) complex
        Beat and Doppler factors.
    amplitudes : (L,) complex
        Their weights.

    Returns
    -------
    tuple of complex arrays
        Factors of the 2L, or for one ramp L, derivatives.
    """
    beat_lines, doppler_lines = factors
    weighted = amplitudes[:, None] * beat_lines
    if doppler_lines.shape[1] == 1:
        return line_slopes(weighted), doppler_lines
    return (
        np.concatenate([line_slopes(weighted), weighted]),
        np.concatenate([doppler_lines, line_slopes(doppler_lines)]),
    )


def doppler_course(shape: tuple[int, int], migration: Coupling = STATIONARY) -> FloatArray:
    """Cycles by which an atom turns per unit of Doppler frequency, (P, N); p without migration.

    See `vsep.kernels.moving_atoms` and `vsep.signal.dithered_atoms`.
    """
    if isinstance(migration, RampDither):
        return migration.course(shape[1])
    num_ramps, num_samples = shape
    middle, samples = 0.5 * (num_ramps - 1), np.arange(num_samples, dtype=np.float64)
    along = migration.ramp_share * (samples - 0.5 * (num_samples - 1))
    ramps = np.arange(num_ramps, dtype=np.float64)[:, None] - middle
    return np.asarray((ramps + along) * (1.0 + migration.coupling * samples) + middle)


def dense_atoms(
    beats: FloatArray,
    dopplers: FloatArray,
    shape: tuple[int, int],
    migration: Coupling = STATIONARY,
) -> ComplexArray:
    """Unit-norm atoms in full, (L, P, N), also of moving objects and dithered ramps.

    Examples
    --------
    >>> import numpy as np
    >>> atom = dense_atoms(np.array([0.1]), np.array([0.2]), (4, 16))[0]
    >>> bool(np.isclose(np.linalg.norm(atom), 1.0))
    True
    """
    if isinstance(migration, RampDither):
        return migration.moving_atoms(np.stack([beats, dopplers], axis=1), shape[1])
    course = doppler_course(shape, migration)
    cycles = beats[:, None, None] * np.arange(shape[1]) + dopplers[:, None, None] * course
    return np.asarray(np.exp(-2j * np.pi * cycles) / np.sqrt(shape[0] * shape[1]))


def half_lines(frequencies: FloatArray, length: int) -> FloatArray:
    """Conjugate lines and their derivatives from the middle on, (2, 3, K, M/2).

    Around its middle the real part of a line is even and the imaginary one odd, so that one half
    has all of it. With x, 2 pi times the distance from there, ``[0]`` has the even ones among 1, x
    and x^2 times these parts, and ``[1]`` the odd ones.

    Parameters
    ----------
    frequencies : (K,) float
        Cycles per step.
    length : int
        M.
    """
    half = (length + 1) // 2
    middle = 0.5 * (length - 1)
    lines = line_factors(frequencies, length)[:, length - half :]
    lines *= np.exp(2j * np.pi * middle * frequencies)[:, None]
    x = 2.0 * np.pi * (np.arange(length - half, length) - middle)
    parts = np.empty((2, 3, len(frequencies), half))
    parts[0, 0], parts[1, 0] = lines.real, -lines.imag
    if length % 2:
        parts[0, 0, :, 0] *= 0.5  # the middle itself is no pair
    for order in (1, 2):
        np.multiply(x, parts[::-1, order - 1], out=parts[:, order])
    return parts


def half_line_jets(beat: FloatArray, doppler: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Inner products of K atoms with each other, (6, K, K), all at rest in the middle of a frame.

    Derivatives by the first atom's frequencies, in the order of `vsep.kernels.line_spectra`.

    Parameters
    ----------
    beat, doppler : (2, 3, K, M/2) float
        Of `half_lines`.
    shape : tuple of int
        (P, N).

    Examples
    --------
    >>> halves = half_lines(np.array([0.1]), 16), half_lines(np.array([0.2]), 4)
    >>> np.abs(half_line_jets(*halves, (4, 16))[:3, 0, 0]).round(12).tolist()
    [1.0, 0.0, 0.0]
    """
    dopplers = _half_line_grams(doppler, is_odd=shape[0] % 2 == 1)
    beats = _half_line_grams(beat, is_odd=shape[1] % 2 == 1)
    return np.asarray(beats[[*BEAT_ORDERS]] * dopplers[[*DOPPLER_ORDERS]])


def _half_line_grams(lines: FloatArray, *, is_odd: bool) -> FloatArray:
    """(3, K, K) inner products of half lines, and derivatives by the first one's frequency."""
    even, odd = lines
    count = lines.shape[2]
    own = np.concatenate([even[0], odd[0]], axis=1)
    by = np.empty((3, *own.shape))
    by[0] = own
    np.concatenate([even[1], odd[1]], axis=1, out=by[1])
    np.negative(by[1, :, : even.shape[2]], out=by[1, :, : even.shape[2]])
    np.concatenate([even[2], odd[2]], axis=1, out=by[2])
    own[:, 0] *= 2.0 if is_odd else 1.0  # the middle, which is half in the other factor
    own *= 2.0
    jets = (by.reshape(3 * count, own.shape[1]) @ own.T).reshape(3, count, count)
    np.negative(jets[2], out=jets[2])
    return np.asarray(jets)
