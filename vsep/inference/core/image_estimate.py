"""Image factor of a receiver from the strongest objects.

Behind the oscillator's mixer a receiver adds ``epsilon conj(y)``. Of every object x_l the residual
e tells ``epsilon_l = <conj(x_l), e> / |x_l|^2``, of variance 1/(lambda |x_l|^2). An unmodelled
object that happens to lie at the image of another makes one of them large; an image factor makes
all of them equal. So misfits beyond `TOLERATED` count no further, and the factor is that on which
most agree, if it explains more than no factor does.
"""

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.state import ObjectComponents
from vsep.kernels.moving_atoms import STATIONARY
from vsep.signal.atoms import line_factors
from vsep.signal.dithered_atoms import Coupling, conjugate_products

EVIDENCE = 20.0  # what a factor must explain, exponential with mean one of each object without any
TOLERATED = 30.0  # misfit of an object, likewise
INEXACT = 0.1  # of the factor: what an object may differ by besides
LARGEST = 0.25  # a larger factor is no error but a converter of real values
ASKED = 12  # strongest objects
CELLS = 0.7  # an object so near to the image of a stronger one may be this image


def is_evident(signal: ComplexArray, residual: ComplexArray, noise_precision: float) -> bool:
    """Whether all objects together show an image of themselves, at any of the antennas."""
    products = np.abs((signal * residual).sum(axis=(1, 2))) ** 2
    energy = np.array([np.vdot(own, own).real for own in signal])
    return bool(np.any(noise_precision * products > EVIDENCE * energy))


def possible_images(
    objects: ObjectComponents, powers: FloatArray, shape: tuple[int, int], noise_precision: float
) -> BoolArray:
    """(L,) which objects lie at images of stronger ones, if that is not mere chance.

    It is chance where a factor that makes them would make more of them than there are.
    """
    beats, dopplers = (each[:, None] + each for each in (objects.beats, objects.dopplers))
    near = np.abs(beats - np.rint(beats)) * shape[1] < CELLS
    near &= np.abs(dopplers - np.rint(dopplers)) * shape[0] < CELLS
    near &= powers[:, None] < LARGEST**2 * powers
    suspects = np.asarray(near.any(axis=1))
    count = np.count_nonzero(suspects)
    if count == 0:
        return suspects
    smallest = float((powers[:, None] / powers)[near].max())  # |epsilon|^2, at most
    expected = np.count_nonzero(noise_precision * smallest * powers > TOLERATED)
    return suspects if 3 * count >= expected else np.zeros_like(suspects)


def image_factors(
    objects: ObjectComponents,
    powers: FloatArray,
    residual: ComplexArray,
    last: ComplexArray,
    noise_precision: float,
    migration: Coupling = STATIONARY,
) -> ComplexArray:
    """Image factor of every antenna (A,), zero where it is not evident.

    Parameters
    ----------
    objects : ObjectComponents
        The objects.
    powers : (L,) float
        Of all antennas.
    residual : (A, P, N) complex
        What they leave, times exp(2j theta): as their images are behind the mixer.
    last : (A,) complex
        What has been taken off the frame already.
    noise_precision : float
        lambda.
    migration : Coupling
        Of the objects' atoms.
    """
    strongest = np.argsort(powers)[-ASKED:]
    weights = objects.amplitudes.reshape(len(powers), -1)[strongest].T  # (A, K)
    num_ramps, num_samples = residual.shape[1:]
    if migration.coupling == 0.0:
        beat = line_factors(objects.beats[strongest], num_samples)
        doppler = line_factors(objects.dopplers[strongest], num_ramps)
        along = residual @ beat.T  # (A, P, K)
        products = weights * np.einsum("apk,kp->ak", along, doppler)
    else:
        points = np.stack([objects.beats[strongest], objects.dopplers[strongest]], axis=1)
        rows = residual.reshape(-1, num_samples)
        products = weights * conjugate_products(points, migration, num_ramps, rows).T
    precisions = noise_precision * np.abs(weights) ** 2
    told = noise_precision * products / np.maximum(precisions, 1e-300) + last[:, None]
    return np.array([_agreed(*each) for each in zip(told, precisions, strict=True)])


def _agreed(told: ComplexArray, precisions: FloatArray) -> complex:
    """Factor that most of the objects agree on, zero if it explains too little."""
    candidates = np.append(told, 0.0)[:, None]
    apart = np.maximum(np.abs(told - candidates) - INEXACT * np.abs(candidates), 0.0)
    misfits = precisions * apart**2
    costs = np.minimum(misfits, TOLERATED).sum(axis=1)
    costs[np.abs(candidates[:, 0]) > LARGEST] = np.inf
    best = int(np.argmin(costs))
    if costs[-1] - costs[best] <= EVIDENCE:
        return 0j
    weights = np.where(misfits[best] < TOLERATED, precisions, 0.0)
    return complex(weights @ told / weights.sum())
