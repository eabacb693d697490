"""Weights of samples that hold noise-like interference, by its mean power there.

Interference that is no chirps is noise of a variance that differs from sample to sample: a band is
swept through with a smooth start and end, and is weak there. A sample counts by the share of the
noise in its variance, as the mean power of neighbouring ramps says it; a few faint samples on
both sides of a wide gap in all ramps tell distances apart that the sides do not. This holds for
what differs from ramp to ramp. What repeats itself would add up as objects do, and does not count.
"""

from typing import Final

import numpy as np
from scipy import fft, ndimage

from vsep._typing import BoolArray, ComplexArray, FloatArray

AROUND: Final = 9  # ramps whose mean power in a sample is that of the interference there
LOUDEST: Final = 30.0  # times its median: what the power of noise exceeds in 1e-9 of all samples
FEWEST_RAMPS: Final = 4  # that tell whether it repeats itself
REPEATED: Final = 1.25  # times the fourth moment over Doppler frequencies that noise has


def noise_like_weights(rows: ComplexArray, support: BoolArray) -> FloatArray:
    """Share of the noise in the variance of samples of noise-like interference.

    Parameters
    ----------
    rows : (P, N) complex
        What objects and bursts leave of the frame of one antenna.
    support : (P, N) bool
        Where the interference is.

    Returns
    -------
    (P, N) float
        Zero outside of the support, and everywhere if the interference repeats itself.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> rows = rng.standard_normal((64, 64, 2)) @ np.array([1.0, 1.0j])
    >>> support = np.zeros((64, 64), dtype=bool)
    >>> support[:, 16:48] = True
    >>> rows[:, 16:48] *= 3.0
    >>> weights = noise_like_weights(rows, support)
    >>> float(weights[support].mean().round(1)), float(weights[0, 0])
    (0.1, 0.0)
    >>> rows[:, 16:48] = rows[0, 16:48]
    >>> float(noise_like_weights(rows, support).max())
    0.0
    """
    power = rows.real**2 + rows.imag**2
    weights = np.zeros(support.shape)
    outside = power[~support]
    noise = 0.0
    if outside.size:  # where interference that is not found yet may be as well
        noise = float(outside[outside <= LOUDEST * np.median(outside)].mean())
    if noise == 0.0:
        return weights
    held = _around(np.where(support, power / noise, 0.0))
    share = _around(support.astype(np.float64))
    mean = np.maximum(np.where(support, held, 0.0) / np.maximum(share, 1e-9), 1.0)
    if not _repeats_itself(np.where(support, rows / np.sqrt(mean), 0.0), support):
        weights[support] = 1.0 / mean[support]
    return weights


def with_faint_samples(
    values: FloatArray,
    rows: ComplexArray,
    noise_like: BoolArray,
    missing: BoolArray | None,
) -> FloatArray:
    """Weights (A P, N) of samples with those of noise-like interference in their place.

    To several antennas an interferer is one direction, which no weight of a sample describes: there
    such samples do not count.

    Parameters
    ----------
    values : (A P, N) float
        Weights as without such interference.
    rows : (A, P, N) complex
        What objects and bursts leave of the frame.
    noise_like, missing : (A P, N) bool
        Where such interference is, and what was never received.
    """
    if len(rows) > 1:
        return np.where(noise_like, 0.0, values)
    faint = noise_like_weights(rows[0], noise_like)
    faint = faint if missing is None else np.where(missing, 0.0, faint)
    return np.where(noise_like, faint, values)


def _around(values: FloatArray) -> FloatArray:
    """Mean over neighbouring ramps."""
    return np.asarray(ndimage.uniform_filter1d(values, AROUND, axis=0, mode="constant"))


def _repeats_itself(rows: ComplexArray, support: BoolArray) -> bool:
    """Whether whitened interference (P, N) adds up in some Doppler frequencies."""
    ramps = support.any(axis=1)
    count = int(np.count_nonzero(ramps))
    if count < FEWEST_RAMPS:
        return True
    lines = fft.fft2(rows[ramps])
    power = lines.real**2 + lines.imag**2
    moment = count * np.sum(power**2, axis=0) / np.maximum(np.sum(power, axis=0), 1e-300) ** 2
    return float(moment.mean()) > REPEATED * 2.0 * count / (count + 1.0)
