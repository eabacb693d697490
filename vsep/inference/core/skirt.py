"""Skirts of noise around strong objects: phase noise of the own oscillator as a noise level.

Phase noise multiplies all that is received by ``1 + j theta``. An object of power p at beat b then
makes noise whose periodogram is expected at

    p sum_k (1 - |k|/N) kappa(k) exp(j 2 pi (f - b) k),

with the autocovariance kappa of theta, one for all objects. It is a sum of decaying exponentials of
dyadic widths with weights that are not negative: those that make the periodogram most likely.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from vsep._typing import FloatArray, frozen
from vsep.signal.atoms import line_factors

WIDTHS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # in cells at half power, and white
STRONGEST = 12  # objects that make a skirt ...
STRONG = 200.0  # ... and about the SNR that the strongest must have to make one that matters
RAISED = 2.0  # deviations by which the level at this object must be higher than elsewhere
EVIDENT = 20.0  # score statistic, chi-square with one degree of freedom where there is no skirt
CLIPPED = 8.0  # deviations over the fitted level: a cell that is more is an object
SCALING_STEPS = 60
LEAST_SKIRT = 0.03  # of the noise: less makes no difference


@dataclass(frozen=True, slots=True, eq=False)
class Skirt:
    """Noise that phase noise makes of the objects of a frame.

    Parameters
    ----------
    shape : (N,) float
        Noise with the skirts over noise without them, at the beats n/N.
    variance : (N,) float
        Relative variance of this.
    own_level : float
        Skirt at the beat of an object itself, over the object's power in a sample.
    phase_std : float
        Standard deviation of theta in rad.
    """

    shape: FloatArray
    variance: FloatArray
    own_level: float
    phase_std: float


def estimate_skirt(
    periodogram: FloatArray, looks: float, beats: FloatArray, powers: FloatArray
) -> Skirt | None:
    """Skirt around objects, from the periodogram of what they leave.

    Parameters
    ----------
    periodogram : (N,) float
        Of the beats n/N.
    looks : float
        Relative variance of a cell is one over this.
    beats, powers : (L,) float
        Of the objects; powers of one sample.

    Returns
    -------
    Skirt or None
        None where no skirt is evident.

    Examples
    --------
    >>> beats, powers = np.array([0.1, -0.3]), np.array([1e4, 10.0])
    >>> terms = skirt_terms(beats, powers, 64)
    >>> found = estimate_skirt(1.0 + 1e-4 * terms[4], 24.0, beats, powers)
    >>> abs(found.phase_std - 0.01) < 0.002
    True
    >>> estimate_skirt(np.ones(64), 24.0, beats, powers) is None
    True
    """
    if len(beats) == 0:
        return None
    level, size = float(periodogram.mean()), len(periodogram)
    strongest = int(np.argmax(powers))
    if powers[strongest] * size * looks < STRONG * level:
        return None
    cell = round(float(beats[strongest]) * size)
    raised = sum(float(periodogram[(cell + near) % size]) for near in (-1, 0, 1)) / 3.0
    if raised < level * (1.0 + RAISED / np.sqrt(3.0 * looks)):
        return None
    excess = np.minimum(periodogram / level, 1.0 + CLIPPED / np.sqrt(looks))
    excess -= excess.mean()
    terms = skirt_terms(beats, powers, len(periodogram))
    score = terms @ excess
    mean = terms.mean(axis=1)
    norms = np.einsum("jn,jn->j", terms, terms) - len(excess) * mean * mean
    # a white skirt is white noise for the most part
    if not np.any((looks * score * np.abs(score) > EVIDENT * norms)[:-1]):
        return None
    weights = _weights(periodogram, terms, looks)
    skirt = weights[1:] @ terms
    if skirt.max() < LEAST_SKIRT * weights[0]:
        return None
    total = weights[0] + skirt
    share = skirt / total
    own = _decays(len(periodogram)).sum(axis=1) * 2.0 - 1.0
    return Skirt(
        shape=total / weights[0],
        variance=share**2 / (looks * max(float(share @ share), 1e-12)),
        own_level=float(weights[1:] @ own),
        phase_std=float(np.sqrt(weights[1:].sum())),
    )


def skirt_terms(beats: FloatArray, powers: FloatArray, num_samples: int) -> FloatArray:
    """(J, N) skirts of phase noise of variance one and of every width."""
    strongest = np.argsort(powers)[-STRONGEST:]
    rows = line_factors(beats[strongest], num_samples)
    covariance = np.sqrt(num_samples) * (powers[strongest] @ rows)
    one_sided = _decays(num_samples) * covariance
    spectra = np.fft.ifft(one_sided, axis=1).real * (2.0 * num_samples)
    return np.asarray(spectra - one_sided[:, :1].real)


@lru_cache(maxsize=8)
def _decays(num_samples: int) -> FloatArray:
    """(J, N) tapered autocovariances (1 - k/N) exp(-2 pi width k/N), the last of white noise."""
    lags = np.arange(num_samples) / num_samples
    decays = (1.0 - lags) * np.exp(-2.0 * np.pi * np.array(WIDTHS)[:, None] * lags)
    return frozen(np.concatenate([decays, [np.arange(num_samples) == 0]]))


def _weights(periodogram: FloatArray, terms: FloatArray, looks: float) -> FloatArray:
    """Most likely weights of white noise and the terms, by multiplicative updates."""
    basis = np.concatenate([np.ones((1, len(periodogram))), terms])
    weights = np.full(len(basis), 0.1) * periodogram.mean() / basis.mean(axis=1)
    weights[0] = np.median(periodogram)
    for _ in range(SCALING_STEPS):
        level = weights @ basis
        seen = np.minimum(periodogram / level, 1.0 + CLIPPED / np.sqrt(looks))
        weights = weights * np.sqrt((basis @ (seen / level)) / (basis @ (1.0 / level)))
    return np.asarray(weights)
