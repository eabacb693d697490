"""Atoms of objects that a radar with dithered ramps sees, and inner products of them.

Ramp p starts by ``delta_p`` later and by ``epsilon_p`` higher than in a sequence of equal ramps.
The radar knows both. An object of delay tau and Doppler frequency nu turns in addition by ``nu
delta_p`` and ``tau epsilon_p`` cycles, so that the phase of sample n is

    -2 pi (beat (n + e_p) + doppler (p + d_p)),    e_p = epsilon_p f_s / k,    d_p = delta_p / T_p .

It stays linear in both frequencies: inner products depend on their differences, are a product of a
sum over the samples and one over the ramps, and derivatives are moments of both sums. The beat of
e_p is the one inside the unambiguous interval, as e_p are no whole samples; neither has the Doppler
frequency a period where start times are dithered.

An object that moves through range cells turns by ``doppler y``, y that of
`vsep.kernels.moving_atoms` at the true starts, with n + e_p for n and p + d_p for p. Its atom is no
product any more and is kept in full.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.moving_atoms import (
    STATIONARY,
    Migration,
    moving_jets,
    moving_products,
    moving_signals,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class RampDither:
    """Starts of the ramps relative to those of equal ramps.

    Parameters
    ----------
    start_ramps : tuple of (P,) float
        d_p, in ramp periods.
    start_samples : tuple of (P,) float
        e_p, in samples of the sweep.
    lowest_beat : float
        Lower edge of the unambiguous interval.
    motion : Migration
        How objects move through range cells.
    """

    start_ramps: tuple[float, ...]
    start_samples: tuple[float, ...]
    lowest_beat: float = -0.5
    motion: Migration = STATIONARY

    @property
    def coupling(self) -> float:
        """Not zero, as of any atom that is no product of a beat and a Doppler factor."""
        return float("inf")

    @property
    def ramps(self) -> FloatArray:
        """(P,) p + d_p."""
        return np.asarray(np.arange(len(self.start_ramps)) + np.array(self.start_ramps))

    @property
    def samples(self) -> FloatArray:
        """(P,) e_p."""
        return np.array(self.start_samples)

    def unambiguous(self, beats: FloatArray) -> FloatArray:
        """Beats inside the unambiguous interval."""
        return np.asarray((beats - self.lowest_beat) % 1.0 + self.lowest_beat)

    def factors(self, points: FloatArray, num_samples: int) -> tuple[ComplexArray, ComplexArray]:
        """Factors (K, N) over the samples and (K, P) over the ramps of atoms at points (K, 2)."""
        cycles = points[:, :1] * np.arange(num_samples)
        turns = self.unambiguous(points[:, :1]) * self.samples + points[:, 1:] * self.ramps
        scales = np.sqrt(num_samples), np.sqrt(len(self.ramps))
        return np.exp(-2j * np.pi * cycles) / scales[0], np.exp(-2j * np.pi * turns) / scales[1]

    def course(self, num_samples: int) -> FloatArray:
        """(P, N) cycles by which an atom turns per unit of Doppler frequency."""
        ramps, (coupling, share, _) = self.ramps[:, None], self.motion
        if coupling == 0.0:
            return np.asarray(np.repeat(ramps, num_samples, axis=1))
        middle, samples = 0.5 * (len(ramps) - 1), np.arange(num_samples)
        along = share * (samples - 0.5 * (num_samples - 1))
        growth = 1.0 + coupling * (samples + self.samples[:, None])
        return np.asarray((ramps - middle + along) * growth + middle)

    def moving_atoms(self, points: FloatArray, num_samples: int) -> ComplexArray:
        """Unit-norm atoms in full, (K, P, N), at points (K, 2)."""
        cycles = points[:, :1, None] * np.arange(num_samples)
        cycles = cycles + points[:, 1:, None] * self.course(num_samples)
        cycles += (self.unambiguous(points[:, :1]) * self.samples)[:, :, None]
        return np.asarray(np.exp(-2j * np.pi * cycles) / np.sqrt(len(self.ramps) * num_samples))

    def atoms(self, points: FloatArray, num_samples: int) -> tuple[ComplexArray, ...]:
        """Return what `pair_jet` takes of atoms: their factors or, if objects move, all of them."""
        if self.motion.coupling == 0.0:
            return self.factors(points, num_samples)
        size = len(self.ramps) * num_samples
        return (self.moving_atoms(points, num_samples).reshape(len(points), size),)


Coupling: TypeAlias = Migration | RampDither
"""How delay and Doppler frequency are coupled within a frame: by motion, or by dithered ramps."""


def coupled_signals(
    points: FloatArray,
    weights: ComplexArray,
    coupling: Coupling,
    num_ramps: int,
    num_samples: int,
) -> ComplexArray:
    """Signals (A P, N) of atoms at points (K, 2) with weights (K, A)."""
    if not isinstance(coupling, RampDither):
        return np.asarray(moving_signals(points, weights.copy(), coupling, num_ramps, num_samples))
    if coupling.motion.coupling != 0.0:
        signals = weights.T @ coupling.atoms(points, num_samples)[0]
        return np.asarray(signals.reshape(-1, num_samples))
    across, along = coupling.factors(points, num_samples)
    rows = weights.T[:, None, :] * along.T  # (A, P, K)
    return np.asarray(rows.reshape(weights.shape[1] * num_ramps, len(points)) @ across)


def coupled_products(
    points: FloatArray, coupling: Coupling, num_ramps: int, signals: ComplexArray
) -> ComplexArray:
    """(K, A) inner products of atoms at points (K, 2) with A signals (A P, N)."""
    if not isinstance(coupling, RampDither):
        return np.asarray(moving_products(points, coupling, num_ramps, signals.copy()))
    if coupling.motion.coupling != 0.0:
        (moving,) = coupling.atoms(points, signals.shape[1])
        return np.asarray(moving.conj() @ signals.reshape(-1, moving.shape[1]).T)
    across, along = coupling.factors(points, signals.shape[1])
    shape = len(signals) // num_ramps, num_ramps, len(points)
    rows = (signals @ across.conj().T).reshape(shape)
    return np.asarray(np.einsum("apk,kp->ka", rows, along.conj()))


def conjugate_products(
    points: FloatArray, coupling: Coupling, num_ramps: int, signals: ComplexArray
) -> ComplexArray:
    """`coupled_products` with the conjugates of the atoms."""
    if not isinstance(coupling, RampDither):
        # The conjugate of an atom is that of the negative frequencies.
        return np.asarray(moving_products(-points, coupling, num_ramps, signals.copy()))
    return coupled_products(points, coupling, num_ramps, signals.conj()).conj()


def coupled_jets(
    points: FloatArray, coupling: Coupling, num_ramps: int, num_samples: int, num_rows: int
) -> ComplexArray:
    """Inner products of atoms at points (K, 2) with each other, see `moving_jets`."""
    if not isinstance(coupling, RampDither):
        return np.asarray(moving_jets(points, coupling, num_ramps, num_samples, num_rows))
    atoms = coupling.atoms(points, num_samples)
    if num_rows == 1:
        gram = np.prod([each.conj() @ each.T for each in atoms], axis=0)
        np.fill_diagonal(gram, gram.diagonal().real)
        return np.asarray(gram[None])
    jets = np.empty((num_rows, len(points), len(points)), dtype=np.complex128)
    for row, point in enumerate(points):
        jets[:, row] = pair_jet(point, atoms, coupling, num_samples)[:num_rows]
    return jets


def pair_jet(
    point: FloatArray, others: tuple[ComplexArray, ...], dither: RampDither, num_samples: int
) -> ComplexArray:
    """Inner products (6, K) of an atom with others, and derivatives by its frequencies.

    The others are what `RampDither.atoms` returns. Rows are the value, first (beat, Doppler) and
    second derivatives (bb, bd, dd).
    """
    if dither.motion.coupling != 0.0:
        return _moving_jet(point, others[0], dither, num_samples)
    across, along = dither.factors(point[None], num_samples)
    samples = _moments(across[0], _centred(num_samples))
    over_samples = samples.conj() @ others[0].T  # (3, K)
    return _jet(over_samples[..., None], along[0].conj() * others[1], dither)


def signal_jet(point: FloatArray, signals: ComplexArray, dither: RampDither) -> ComplexArray:
    """Inner products (6, A) of an atom with signals (A, P, N), rows as of `pair_jet`."""
    if dither.motion.coupling != 0.0:
        return _moving_jet(point, signals.reshape(len(signals), -1), dither, signals.shape[2])
    across, along = dither.factors(point[None], signals.shape[2])
    samples = _moments(across[0], _centred(signals.shape[2]))
    over_samples = np.moveaxis(signals @ samples.conj().T, 2, 0)  # (3, A, P)
    return _jet(over_samples, along.conj(), dither)


def _moving_jet(
    point: FloatArray, signals: ComplexArray, dither: RampDither, num_samples: int
) -> ComplexArray:
    """Rows of `pair_jet` of an atom that is no product, with signals (K, P N)."""
    atom = dither.moving_atoms(point[None], num_samples)[0].conj()
    x, y = np.arange(num_samples) + dither.samples[:, None], dither.course(num_samples)
    x, y = x - x.mean(), y - y.mean()
    by_beat, by_doppler = x * atom, y * atom
    rows = np.stack([atom, by_beat, by_doppler, x * by_beat, y * by_beat, y * by_doppler])
    turns = (2j * np.pi) ** np.array([0, 1, 1, 2, 2, 2])
    return np.asarray(turns[:, None] * (rows.reshape(6, -1) @ signals.T))


def _centred(size: int) -> FloatArray:
    return np.asarray(np.arange(size) - 0.5 * (size - 1))


def _moments(line: ComplexArray, places: FloatArray) -> ComplexArray:
    """(3, N) a line times its places to the powers 0, 1, 2."""
    return np.stack([line, places * line, places**2 * line])


def _jet(over_samples: ComplexArray, along: ComplexArray, dither: RampDither) -> ComplexArray:
    """Sum over the ramps moments over the samples, (3, K, P or 1), with factors (K or 1, P)."""
    zeroth, first, second = over_samples
    e = dither.samples - dither.samples.mean()
    y = dither.ramps - dither.ramps.mean()
    by_beat = first + e * zeroth  # sums of x = n + e_p, and of its square
    twice = second + 2.0 * e * first + e**2 * zeroth
    weighed = [zeroth, by_beat, y * zeroth, twice, y * by_beat, y**2 * zeroth]
    turns = (2j * np.pi) ** np.array([0, 1, 1, 2, 2, 2])
    sums = [np.sum(each * along, axis=-1) for each in weighed]
    return np.asarray(turns[:, None] * np.stack(sums))
