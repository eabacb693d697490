"""Cramer-Rao bound of the objects' frequencies in model (9), interference known or not.

The mean of the received signal is ``Phi(zeta) alpha + U(theta) Psi(vartheta) beta``, its noise
white with precision lambda. With J the derivatives of the mean by all real unknowns (beats,
Dopplers, real and imaginary parts of alpha; per burst the chirp parameters and the real and
imaginary parts of beta) the Fisher information is ``2 lambda Re{J^H J}``. The delays of the
interference channel stay on their grid and are known: a common shift of them is a shift of the
burst's start frequency, so nothing else would be identifiable.

Deterministic: amplitudes are unknown constants without a prior.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from vsep._typing import ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.analysis.burst_model import Burst
from vsep.signal.atoms import DispersionStd, dense_atoms, doppler_course
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.scene import GroundTruth
from vsep.signal.template import SignalModel

# A direction in parameter space that changes the signal by less than this share of what its
# parameters could is not observable.
_UNOBSERVABLE = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class DispersionBound(DispersionStd):
    """Smallest standard deviations that an unbiased estimator can have."""

    @property
    def root_mean_crlb(self) -> float:
        """Root of the mean over the objects of beat plus Doppler variance; NaN without objects."""
        if len(self.beats) == 0:
            return float("nan")
        dopplers = np.where(np.isinf(self.dopplers), 0.0, self.dopplers)
        return float(np.sqrt(np.mean(self.beats**2 + dopplers**2)))


def single_line_bound(snr: float, num_samples: int) -> float:
    """Root CRLB of the frequency of one line with unknown complex weight, in closed form.

    Parameters
    ----------
    snr : float
        (25), linear.
    num_samples : int
        N, at least 2.

    Examples
    --------
    >>> f"{single_line_bound(1e3, 256):.3e}"
    '4.816e-05'
    """
    require_range("snr", snr, 1e-300, 1e300)
    require_range("num_samples", num_samples, 2, 2**31)
    return math.sqrt(6.0 / (snr * (2.0 * math.pi) ** 2 * (num_samples**2 - 1)))


def dispersion_bound(
    truth: GroundTruth, model: SignalModel, bursts: Sequence[Burst] = ()
) -> DispersionBound:
    """Root CRLB of every object's beat and Doppler frequency.

    Parameters
    ----------
    truth : GroundTruth
        Objects and noise level.
    model : SignalModel
        Size, sampling and the *true* filter.
    bursts : sequence of Burst
        Bursts whose chirp parameters and weights are unknown too; none if the interference is
        known or absent.

    Returns
    -------
    DispersionBound
        Infinite where the unknowns cannot be told apart.

    Raises
    ------
    InputError
        If the noise level is unknown.
    """
    require_range("noise_precision", truth.noise_precision, 1e-300, 1e300)
    num_objects = len(truth.beats)
    single = model.num_ramps == 1
    unknown = np.full(num_objects, np.inf)
    if num_objects == 0:
        return DispersionBound(beats=unknown, dopplers=unknown)
    atoms, moved = _object_columns(truth, model)
    nuisance = np.concatenate([atoms, 1j * atoms])
    for ramp in sorted({burst.ramp for burst in bursts}):
        columns = [_burst_columns(burst, model) for burst in bursts if burst.ramp == ramp]
        basis = _orthonormal(np.concatenate(columns))
        for block in (nuisance, moved):
            block[:, ramp] = _without(basis, block[:, ramp])
    deviations = _marginal_deviations(nuisance, moved) / math.sqrt(2.0 * truth.noise_precision)
    return DispersionBound(
        beats=deviations[:num_objects], dopplers=unknown if single else deviations[num_objects:]
    )


def shared_dispersion_bound(truth: GroundTruth, model: SignalModel) -> DispersionBound:
    """Root CRLB of places that several antennas share, each with complex weights of its own.

    Interference is known or absent; short bursts raise the bound by about 0.01 %.

    Parameters
    ----------
    truth : GroundTruth
        Objects with amplitudes (L, A), and the noise level.
    model : SignalModel
        Size and sampling.

    Raises
    ------
    InputError
        If the noise level is unknown.
    """
    require_range("noise_precision", truth.noise_precision, 1e-300, 1e300)
    num_objects, single = len(truth.beats), model.num_ramps == 1
    unknown = np.full(num_objects, np.inf)
    if num_objects == 0:
        return DispersionBound(beats=unknown, dopplers=unknown)
    bare = replace(truth, amplitudes=np.ones(num_objects, dtype=np.complex128))
    atoms, moved = (each.reshape(len(each), -1) for each in _object_columns(bare, model))
    basis = qr(atoms.T, mode="economic", check_finite=False)[0]
    projected = moved.T - basis @ (basis.conj().T @ moved.T)
    weights = np.tile(truth.amplitudes, (len(moved) // num_objects, 1))
    together = (projected.conj().T @ projected) * (weights.conj() @ weights.T)
    fisher = 2.0 * truth.noise_precision * together.real
    deviations = np.sqrt(np.diagonal(np.linalg.inv(fisher)))
    return DispersionBound(
        beats=deviations[:num_objects], dopplers=unknown if single else deviations[num_objects:]
    )


def _object_columns(truth: GroundTruth, model: SignalModel) -> tuple[ComplexArray, ComplexArray]:
    """Atoms (L, P, N), and derivatives of the mean by beats, then Dopplers, (L or 2L, P, N)."""
    num_ramps, num_samples = model.shape
    # Counted from the middle: the unknown phases absorb the difference, the columns stay apart.
    samples = -2j * np.pi * (np.arange(num_samples) - 0.5 * (num_samples - 1))
    if isinstance(model.migration, RampDither):
        samples = samples - 2j * np.pi * model.migration.samples[:, None]
    course = doppler_course(model.shape, model.migration)
    turns = -2j * np.pi * (course - 0.5 * (num_ramps - 1))
    atoms = dense_atoms(truth.beats, truth.dopplers, model.shape, model.migration)
    weighted = truth.amplitudes[:, None, None] * atoms
    if num_ramps == 1:
        return atoms, weighted * samples
    return atoms, np.concatenate([weighted * samples, weighted * turns])


def _burst_columns(burst: Burst, model: SignalModel) -> ComplexArray:
    """Differentiate the burst by theta and by the real and imaginary parts of beta, (2+2K, N)."""
    centre = -burst.start_frequency / burst.slope
    template, slopes = model.template_jet(burst.start_frequency, burst.slope, centre)
    lines = burst.lines(model.num_samples)
    by_weight = template * lines
    return np.concatenate([slopes * (burst.amplitudes @ lines), by_weight, 1j * by_weight])


def _as_real(columns: ComplexArray) -> FloatArray:
    """Write complex columns, one a row, as real ones: real part, then imaginary part."""
    flat = columns.reshape(len(columns), -1)
    return np.concatenate([flat.real, flat.imag], axis=1)


def _unit_length(real: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scale real columns, one a row, to length one; return them and their lengths."""
    lengths = np.linalg.norm(real, axis=1)
    lengths[lengths == 0.0] = 1.0
    return real / lengths[:, None], lengths


def _orthonormal(columns: ComplexArray) -> FloatArray:
    """Return an orthonormal basis, one vector a row, of the real span of complex columns."""
    scaled, _ = _unit_length(_as_real(columns))
    return np.asarray(qr(scaled.T, mode="economic", check_finite=False)[0].T, dtype=np.float64)


def _without(basis: FloatArray, columns: ComplexArray) -> ComplexArray:
    """Take the part that lies in the span of a basis out of complex columns, one a row.

    A burst lives in its own ramp, so its unknowns are eliminated there before anything else.
    """
    real = _as_real(columns)
    # Twice: rounding of the first pass leaves a trace where the bases are nearly dependent.
    for _ in range(2):
        real = real - (real @ basis.T) @ basis
    half = real.shape[1] // 2
    return np.asarray(real[:, :half] + 1j * real[:, half:])


def _marginal_deviations(nuisance: ComplexArray, wanted: ComplexArray) -> FloatArray:
    """Square roots of the diagonal of the wanted block of (J^T J)^-1, J real, one row a column.

    With the wanted columns last in J = Q R, the lower right block of R is what is left of them
    orthogonal to the nuisance columns; its inverse holds the answer. No J^T J is formed.
    """
    scaled, lengths = _unit_length(_as_real(np.concatenate([nuisance, wanted])))
    triangle = qr(scaled.T, mode="r", check_finite=False)[0]
    block = triangle[len(nuisance) : len(scaled), len(nuisance) :]
    _, strengths, directions = np.linalg.svd(block)
    seen = strengths > _UNOBSERVABLE
    # An unobservable direction costs only the parameters that have a share in it.
    hidden = np.any(np.abs(directions[~seen]) > _UNOBSERVABLE, axis=0)
    spread = directions[seen] / strengths[seen, None]
    deviations = np.linalg.norm(spread, axis=0) / lengths[len(nuisance) :]
    return np.asarray(np.where(hidden, np.inf, deviations))
