"""Weights of samples that both sources explain badly.

Deviation: the model of a burst is never exact. An interferer that switches on or off inside the
band, a clipped sample, a second burst in the same ramp or a filter other than the assumed one leave
more than noise under the burst. There the noise of a sample has the variance

    1/lambda + kappa |U Psi beta|^2

with the burst's power averaged over neighbouring samples. kappa is estimated for every ramp and is
zero without evidence; a sample counts by the share of the noise in its variance. Samples far above
the noise that no burst accounts for do not count at all. With a large kappa this is the masked
estimator.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.core.state import SeparationState

AVERAGED = 5  # samples over which powers are averaged
LOUD = 10.0  # times the noise: burst power from which kappa is measured
EVIDENCE = 4.0  # deviations by which what is left under a ramp's bursts must exceed the noise
COUNTED = 0.7  # weight from which a sample tells of the noise level
UNEXPLAINED = 20.0  # times the noise power: one in 5e8 noise samples is more ...
CERTAIN = 5.0  # ... and the mean of so many of them once in 4e6
RAISED = 2.5  # times the noise power: how far a run reaches
GAP_REACH = 2  # of raised samples into a gap from either side
ALONG_THE_RAMP = np.array([[False] * 3, [True] * 3, [False] * 3])


@dataclass(frozen=True, slots=True, eq=False)
class SampleWeights:
    """How much every sample of a frame counts.

    Parameters
    ----------
    values : (P, N) float
        Between 0 and 1.
    """

    values: FloatArray

    @property
    def counted(self) -> BoolArray:
        """(P, N) samples that are noise for the most part."""
        return np.asarray(self.values > COUNTED)

    @property
    def num_counted(self) -> int:
        """Samples that tell of the noise level."""
        return max(int(np.count_nonzero(self.counted)), 2)

    @property
    def share(self) -> float:
        """Information that is left, as a share of the samples."""
        return max(float(self.values.mean()), 2.0 / self.values.size)

    def counting(self, rows: IntArray, missing: BoolArray | None) -> "SampleWeights":
        """Return weights with which all of some rows counts, as far as it was received."""
        values = self.values.copy()
        values[rows] = 1.0 if missing is None else ~missing[rows]
        return SampleWeights(values)

    def fitted(self, received: ComplexArray, explained: ComplexArray) -> ComplexArray:
        """Return the frame with what is explained in the place of what does not count."""
        return explained + self.values * (received - explained)


def sample_weights(
    received: ComplexArray,
    object_signal: ComplexArray,
    interference_signal: ComplexArray,
    *,
    fitted: bool,
) -> SampleWeights | None:
    """Weights of the samples of a frame.

    Parameters
    ----------
    received, object_signal, interference_signal : (P, N) complex
        The frame, and what the sources predict of it.
    fitted : bool
        Whether the bursts' channels are complete. Before, what is left under a burst is what they
        have not reached yet, and a kappa would keep them from it: only what is far above the noise
        is set aside.

    Returns
    -------
    SampleWeights or None
        None where every sample counts fully.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.exp(2j * np.pi * np.random.default_rng(1).uniform(size=(1, 64)))
    >>> frame = noise + 100.0 * (np.arange(64) == 20)
    >>> nothing = np.zeros((1, 64), dtype=complex)
    >>> weights = sample_weights(frame, nothing, nothing, fitted=True)
    >>> float(weights.values[0, 20]), weights.num_counted < 64
    (0.0, True)
    """
    noise_residual = received - object_signal - interference_signal
    power = noise_residual.real**2 + noise_residual.imag**2
    noise = usual_power(power)
    values = _under_bursts(power, interference_signal, noise) if fitted else None
    certain = CERTAIN if fitted else math.inf
    unexplained = louder_runs(power if values is None else power * values, noise, certain)
    if values is None and unexplained is None:
        return None
    values = np.ones(power.shape) if values is None else values
    return SampleWeights(values if unexplained is None else np.where(unexplained, 0.0, values))


def holds_clicks(received: ComplexArray, state: SeparationState, missing: BoolArray | None) -> bool:
    """Whether single samples, beside those that are not used, are far above the noise."""
    explained = state.object_signal + state.interference_signal
    for samples in (missing, state.noise_like):
        if samples is not None:
            received = np.where(samples, explained, received)
    return sample_weights(received, explained, np.zeros_like(explained), fitted=False) is not None


def _under_bursts(
    power: FloatArray, interference_signal: ComplexArray, noise: float
) -> FloatArray | None:
    """Share of the noise in the variance of every sample; None without evidence for any kappa."""
    burst = interference_signal.real**2 + interference_signal.imag**2
    loud_rows = burst.max(axis=1) > LOUD * noise
    if not loud_rows.any():
        return None
    burst = ndimage.uniform_filter1d(burst[loud_rows], AVERAGED, axis=1)
    loud = burst > LOUD * noise
    count = np.maximum(loud.sum(axis=1), 1)
    excess = np.where(loud, power[loud_rows] - noise, 0.0).sum(axis=1)
    # The powers of noise samples deviate by as much as they are.
    evident = excess > EVIDENCE * noise * np.sqrt(count)
    if not evident.any():
        return None
    energy = np.where(loud, burst, 0.0).sum(axis=1)
    kappa = np.where(evident, excess / np.maximum(energy, 1e-300), 0.0)
    values = np.ones(power.shape)
    values[loud_rows] = noise / (noise + kappa[:, None] * burst)
    return values


def louder_runs(power: FloatArray, noise: float, certain_mean: float = CERTAIN) -> BoolArray | None:
    """Find runs of samples that are louder than noise; None if there are none.

    Parameters
    ----------
    power : (P, N) float
        Of the samples.
    noise : float
        Noise power.
    certain_mean : float
        Times the noise power: what the mean of `AVERAGED` samples must exceed.
    """
    single = power > UNEXPLAINED * noise
    # Means of the others: a click must not make its neighbours suspect.
    expected: FloatArray | float = noise
    others = power
    rows = single.any(axis=1)
    if rows.any():
        others = np.where(single, 0.0, power)
        expected = np.full(power.shape, noise)
        share = ndimage.uniform_filter1d(np.where(single[rows], 0.0, 1.0), AVERAGED, axis=1)
        expected[rows] = noise * share
    around = ndimage.uniform_filter1d(others, AVERAGED, axis=1)
    certain = single | (around > certain_mean * expected)
    rows = certain.any(axis=1)
    if not rows.any():
        return None
    # Seeds, and the raised samples beside them across small gaps
    seeds = certain[rows]
    raised = seeds | (around > RAISED * expected)[rows]
    raised |= ndimage.binary_closing(raised, ALONG_THE_RAMP, GAP_REACH)
    certain[rows] = ndimage.binary_propagation(seeds, ALONG_THE_RAMP, raised)
    return np.asarray(certain)


def usual_power(power: FloatArray) -> float:
    """Mean power of noise by the median of all samples, none of them NaN.

    Louder ones hardly raise it; the median of an exponential law is ln 2 its mean.
    """
    middle = power.size // 2
    ordered = np.partition(power.ravel(), middle)  # by two places at once it takes eight times that
    median = float(ordered[middle])
    if power.size % 2 == 0:
        median = 0.5 * (median + float(ordered[:middle].max()))
    return median / math.log(2.0)
