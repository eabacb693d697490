"""Posterior standard deviations of the dispersion parameters zeta.

Around its maximum the joint cost (67) is quadratic; its curvature is the Fisher information of all
frequencies with the complex weights as nuisance parameters,
``F = 2 lambda Re{ B^H (I - lambda Phi C Phi^H) B }``, where B holds the derivatives of the atoms
times their weights. The interference enters through lambda only: not knowing it raises the bound
by about 0.01 % where bursts are short.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, pinvh
from scipy.linalg.lapack import dpotrf, dpotri

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.noise_spectrum import NoiseSpectrum
from vsep.inference.core.state import ObjectComponents
from vsep.kernels.moving_atoms import STATIONARY
from vsep.signal.atoms import DispersionStd, half_line_jets, half_lines
from vsep.signal.dithered_atoms import Coupling, coupled_jets

LEAST_PIVOT = 1e-10  # of a frequency's information: what the others leave of it


def fisher_information(
    beats: FloatArray,
    dopplers: FloatArray,
    amplitudes: ComplexArray,
    precisions: FloatArray,
    noise_precision: float,
    shape: tuple[int, int],
    migration: Coupling = STATIONARY,
) -> FloatArray:
    """Fisher information of (beats, dopplers) with unknown complex weights.

    Parameters
    ----------
    beats, dopplers : (L,) float
        Normalised frequencies.
    amplitudes : (L,) or, of several antennas, (L, A) complex
        Weights of unit-norm atoms.
    precisions : (L,) float
        Prior precisions of the weights; zeros give the deterministic bound.
    noise_precision : float
        lambda.
    shape : tuple of int
        (P, N).
    migration : Migration
        How objects move through range cells.

    Returns
    -------
    (2L, 2L) or, for one ramp, (L, L) float

    Examples
    --------
    One line at 30 dB in 256 samples: the root of the Cramer-Rao bound is 4.816e-5.

    >>> import numpy as np
    >>> fisher = fisher_information(np.array([0.1]), np.zeros(1), np.ones(1, dtype=complex),
    ...                             np.zeros(1), 1e3, (1, 256))
    >>> f"{fisher[0, 0] ** -0.5:.3e}"
    '4.816e-05'
    """
    weights = amplitudes if amplitudes.ndim == 2 else amplitudes[:, None]
    if migration.coupling == 0.0:
        # The phases of atoms and weights that are at rest in the middle of the frame
        middle = 0.5 * (np.array(shape[::-1]) - 1.0)
        turned = np.exp(-2j * np.pi * (middle[0] * beats + middle[1] * dopplers))
        weights = weights * turned[:, None]
        halves = half_lines(beats, shape[1]), half_lines(dopplers, shape[0])
        jets: FloatArray | ComplexArray = half_line_jets(*halves, shape)
    else:
        points = np.stack([beats, dopplers], axis=1)
        jets = coupled_jets(points, migration, *shape, 6)
    axes = 1 if shape[0] == 1 and migration.coupling == 0.0 else 2
    value, *first = jets[: axes + 1]
    second = np.block([[jets[3], jets[4]], [jets[4], jets[5]]])
    size = axes * len(beats)
    # Derivatives by the second atom's frequencies have the other sign.
    moved, slopes = -second[:size, :size], np.concatenate(first)
    posterior = cho_factor(noise_precision * value + np.diag(precisions), lower=True)  # (59)
    explained = noise_precision * slopes @ cho_solve(posterior, slopes.conj().T)
    # What is learnt at each antenna adds up.
    powers = np.tile(weights.conj() @ weights.T, (axes, axes))
    left = moved - explained  # dphi^H (I - lambda Phi C Phi^H) dphi
    if np.isrealobj(left):
        return 2.0 * noise_precision * (left * powers.real)
    fisher: FloatArray = 2.0 * noise_precision * (left.real * powers.real - left.imag * powers.imag)
    return fisher


def dispersion_std(
    objects: ObjectComponents,
    noise_precision: float,
    shape: tuple[int, int],
    relative_noise: NoiseSpectrum | None = None,
    migration: Coupling = STATIONARY,
) -> DispersionStd:
    """Posterior standard deviations of every object's beat and Doppler frequency.

    Parameters
    ----------
    objects : ObjectComponents
        Posterior of the object channel.
    noise_precision : float
        lambda.
    shape : tuple of int
        (P, N).
    relative_noise : NoiseSpectrum, optional
        Noise over beat frequency in units of 1/lambda.
    migration : Migration
        How objects move through range cells.
    """
    num_objects = objects.num_components
    unknown = np.full(num_objects, np.inf)
    if num_objects == 0:
        return DispersionStd(beats=np.zeros(0), dopplers=np.zeros(0))
    fisher = fisher_information(
        objects.beats,
        objects.dopplers,
        objects.amplitudes,
        objects.precisions,
        noise_precision,
        shape,
        migration,
    )
    variance = _inverse_diagonal(fisher)
    if relative_noise is not None:  # a line sees the noise around its beat
        level = relative_noise.level(objects.beats)
        variance = variance * np.tile(level, len(variance) // num_objects)
    deviation = np.sqrt(variance)
    if shape[0] == 1:
        return DispersionStd(beats=deviation, dopplers=unknown)
    return DispersionStd(beats=deviation[:num_objects], dopplers=deviation[num_objects:])


def _inverse_diagonal(information: FloatArray) -> FloatArray:
    """Diagonal of the inverse of a Fisher information."""
    if np.diagonal(information).min() > np.finfo(float).tiny:
        scale = np.sqrt(np.diagonal(information))
        factor, failed = dpotrf(information / np.outer(scale, scale))
        if not failed and np.diagonal(factor).min() ** 2 >= LEAST_PIVOT:
            inverse, _ = dpotri(factor, overwrite_c=True)
            return np.asarray(np.diagonal(inverse) / scale**2)
    # Coincident components, or one of no amplitude, make it singular; the pseudo-inverse keeps the
    # others' figures.
    return np.maximum(np.diagonal(pinvh(information)), 0.0)
