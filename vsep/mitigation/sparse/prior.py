"""The prior model of PM-IST and PM-IHT: where objects were, thresholds are lower, (13)-(16).

The cells where CA-CFAR found a peak in one of the last Q frames have a normal distribution of the
peak's magnitude, (16). How probable the last frame's magnitude is under it becomes, spread by a
window G and mapped by zeta, the share by which the threshold of a cell is lowered.
"""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

import numpy as np
from scipy.fft import fft2, ifft2

from vsep._typing import BoolArray, FloatArray, frozen
from vsep._validation import require_choice, require_range
from vsep.errors import InputError
from vsep.mitigation.cfar import Cfar
from vsep.mitigation.method import FrameArray
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.dithered_spectra import dithered_transform
from vsep.signal.spectra import hann_window

Reading: TypeAlias = Literal["likelihood", "density"]
_MIN_SPREAD = 0.25  # sigma over mu: a cell seen once has no empirical spread at all


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SeenFrame:
    """What one past frame says about its cells."""

    magnitude: FloatArray  #: (P, N) of the windowed range-Doppler spectrum
    peaks: BoolArray  #: (P, N) where CA-CFAR found a peak


@dataclass(frozen=True, kw_only=True, slots=True)
class PriorModel:
    """Settings of the prior model.

    Raises `InputError` if a setting is out of its range.
    """

    num_frames: int = 3  #: Q, how many past frames count
    #: What p of (16) is. "likelihood": the normal distribution relative to its peak,
    #: ``exp(-(x - mu)^2 / (2 sigma^2))``, which has no unit and lies between 0 and 1. "density":
    #: the probability density itself, as the source prints it; it has the inverse unit of the
    #: spectrum, so zeta depends on the level of the frame and its divisor must suit it.
    reading: Reading = "likelihood"
    #: half-widths of G, a Hann window of unit peak, in cells along ramps and samples. The main lobe
    #: of a windowed object reaches over two cells on either side, its motion over more.
    reach: tuple[int, int] = (3, 3)
    #: a, b, e of ``zeta(p) = (a p + b) / e``, (14)
    gain: float = 1.0
    offset: float = 0.0
    divisor: float = 1.25
    #: zeta is clipped to this value; soft thresholds may fall close to zero, hard ones may not, or
    #: noise passes unshrunk
    largest: float = 0.95
    detector: Cfar = field(default_factory=lambda: Cfar(false_alarm_rate=1e-6))  #: finds the peaks

    def __post_init__(self) -> None:
        """Check the settings."""
        require_range("num_frames", self.num_frames, 1, 1000)
        require_range("largest", self.largest, 0.0, 1.0)
        require_range("smallest reach", min(self.reach), 0, 1000)
        require_choice("reading", self.reading, get_args(Reading))
        if self.divisor == 0.0:
            raise InputError("divisor is 0; it must not be zero.")

    def see(
        self,
        history: tuple[SeenFrame, ...],
        frame: FrameArray,
        dither: RampDither | None = None,
    ) -> tuple[SeenFrame, ...]:
        """Add a frame, original or recovered, to the history; the oldest falls out.

        One that is too small for the detector says nothing, and the history stays.

        Parameters
        ----------
        history : tuple of SeenFrame
            Past frames, the oldest first.
        frame : (P, N) complex
            The next one.
        dither : RampDither, optional
            How its ramps were dithered.
        """
        if not self.detector.fits(frame.shape):
            return history
        window = np.outer(hann_window(frame.shape[0]), hann_window(frame.shape[1]))
        windowed = window * frame
        if dither is None:
            magnitude = np.abs(ifft2(windowed, norm="ortho"))
        else:
            transform = dithered_transform(dither, frame.shape[1], np.complex128)
            magnitude = np.abs(transform.analysis(windowed))
        peaks = np.zeros(frame.shape, dtype=np.bool_)
        peaks[tuple(self.detector.peaks(magnitude**2).T)] = True
        seen = SeenFrame(magnitude=frozen(magnitude), peaks=frozen(peaks))
        return (*history, seen)[-self.num_frames :]

    def relief(self, history: tuple[SeenFrame, ...]) -> FloatArray | None:
        """(P, N) zeta(p), the share by which thresholds are lowered; None without a history."""
        if not history:
            return None
        probability = _spread(self._probability(history), self.reach)
        zeta = (self.gain * probability + self.offset) / self.divisor
        return frozen(np.clip(zeta, 0.0, self.largest))

    def _probability(self, history: tuple[SeenFrame, ...]) -> FloatArray:
        """(P, N) p of (16) in the cells with a peak, zero elsewhere."""
        peaks = np.array([seen.peaks for seen in history])
        magnitudes = np.array([seen.magnitude for seen in history])
        count = np.maximum(peaks.sum(axis=0), 1)
        mean = np.where(peaks, magnitudes, 0.0).sum(axis=0) / count
        square = np.where(peaks, (magnitudes - mean) ** 2, 0.0).sum(axis=0) / count
        deviation = np.maximum(np.sqrt(square), _MIN_SPREAD * mean)
        known = peaks.any(axis=0) & (deviation > 0.0)
        deviation = np.where(known, deviation, 1.0)
        probability = np.exp(-0.5 * ((magnitudes[-1] - mean) / deviation) ** 2)
        if self.reading == "density":
            probability = probability / (np.sqrt(2.0 * np.pi) * deviation)
        return np.where(known, probability, 0.0)


def _spread(probability: FloatArray, reach: tuple[int, int]) -> FloatArray:
    """Convolve with the window G of unit peak, cyclically as spectra are."""
    if not np.any(probability):
        return probability
    kernel = np.zeros(probability.shape)
    rows, columns = (
        np.arange(-half, half + 1) % length
        for half, length in zip(reach, probability.shape, strict=True)
    )
    weights = np.outer(hann_window(len(rows)), hann_window(len(columns)))
    np.add.at(kernel, np.ix_(rows, columns), weights)
    spread = ifft2(fft2(probability) * fft2(kernel)).real
    # What the transforms leave beside the window is rounding.
    return np.where(spread > 1e-12 * spread.max(), spread, 0.0)
