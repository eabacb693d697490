"""Morphological component analysis: objects sparse in frequency, bursts in short-time frequency.

The alternating hard thresholding of J.-L. Starck, F. Murtagh and J. Fadili, Sparse Image and Signal
Processing, Algorithm 30: what one layer leaves is thresholded by the other, at a level that falls
from iteration to iteration, exponentially and never below the noise of what both leave. Soft
thresholds leak one source into the other. The object layer is a DFT per ramp, as in the paper, or
of the whole frame.

Chosen here: the frame is windowed (Hann) along the axes of the object layer, without which lines
between the bins are not sparse; as the other methods do, only flagged samples are replaced. Without
a mask, as in F. Uysal, Synchronous and Asynchronous Radar Interference Mitigation, IEEE Access 7
(2019), which the paper compares with, there is neither: the object layer is the cleaned frame.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, FloatArray, frozen
from vsep._validation import require_range
from vsep.inference.core.progress import Termination
from vsep.mitigation.entry import time_domain_entry
from vsep.mitigation.method import FrameArray, MitigationState, require_clean
from vsep.mitigation.short_time import ShortTimeFrame
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.dithered_spectra import dithered_transform
from vsep.signal.spectra import hann_window

ITERATIONS = 100
MIN_LEVEL = 1e-5  # of the first level, at the last iteration
NOISE_LEVELS = 3.0  # times the noise level: where a threshold stops falling


@dataclass(frozen=True, slots=True, eq=False)
class Layers:
    """The two layers (P, N) of the windowed frame, and the first threshold."""

    objects: FrameArray
    bursts: FrameArray
    first_level: float


@dataclass(frozen=True, kw_only=True, slots=True)
class MorphologicalComponents:
    """Morphological component analysis of a frame."""

    name: str = "mca"  #: the name a user calls it by
    num_axes: int = 1  #: axes of the object layer: the ramp alone, or the frame
    iterations: int = ITERATIONS  #: number of thresholds
    masked: bool = True  #: whether only flagged samples are replaced, and the frame is windowed
    dither: RampDither | None = None  #: how ramps were dithered, of which ramp by ramp none matters

    def __post_init__(self) -> None:
        """Check the settings."""
        require_range("num_axes", self.num_axes, 1, 2)
        require_range("iterations", self.iterations, 1, 100_000)

    def init(self, received: FrameArray, mask: BoolArray) -> MitigationState:
        """State before the first step: both layers empty.

        Raises `InputError` if no sample is clean.
        """
        if self.masked:
            require_clean(mask)
        windowed = received * self._window(received)
        short_time = ShortTimeFrame(received.shape[1])
        largest = [np.abs(self._to_bins(windowed)), np.abs(short_time.analyse(windowed))]
        nothing = frozen(np.zeros_like(received))
        layers = Layers(nothing, nothing, min(float(bins.max()) for bins in largest))
        return MitigationState(
            iteration=0,
            cleaned=frozen(np.where(mask & self.masked, received.dtype.type(0), received)),
            memory=layers,
        )

    def step(
        self, received: FrameArray, mask: BoolArray, state: MitigationState
    ) -> MitigationState:
        """Threshold the objects, then the bursts."""
        layers = state.memory
        assert isinstance(layers, Layers)  # from init or step
        window = self._window(received)
        windowed = received * window
        level = self._level(windowed - layers.objects - layers.bursts, state.iteration, layers)
        bins = _above(self._to_bins(windowed - layers.bursts), level)
        objects = self._from_bins(bins)
        short_time = ShortTimeFrame(received.shape[1])
        bursts = short_time.synthesize(_above(short_time.analyse(windowed - objects), level))
        moved = float(np.linalg.norm(objects - layers.objects))
        return MitigationState(
            iteration=state.iteration + 1,
            cleaned=frozen(self._cleaned(received, mask, objects / window, bursts)),
            change=moved / max(float(np.linalg.norm(objects)), np.finfo(np.float64).tiny),
            memory=Layers(frozen(objects), frozen(bursts), layers.first_level),
        )

    def terminate(self, state: MitigationState) -> Termination:
        """After the last threshold."""
        ended = state.iteration >= self.iterations
        return Termination.CONVERGED if ended else Termination.RUNNING

    def _cleaned(
        self, received: FrameArray, mask: BoolArray, objects: FrameArray, bursts: FrameArray
    ) -> FrameArray:
        """Fill in the object layer; where no object exceeds the noise the noise stays."""
        if self.masked:
            return np.where(mask, objects, received)
        return objects if np.any(objects) else received - bursts

    def _level(self, unexplained: FrameArray, iteration: int, layers: Layers) -> float:
        """Threshold of an iteration; the median of noise power is ln 2 times its mean."""
        power = np.median(np.abs(self._to_bins(unexplained)) ** 2) / np.log(2.0)
        falling = float(MIN_LEVEL ** (iteration / max(self.iterations - 1, 1)))
        return max(layers.first_level * falling, NOISE_LEVELS * float(np.sqrt(power)))

    def _window(self, received: FrameArray) -> FloatArray:
        """Window in the frame's precision; it is nowhere zero."""
        num_ramps, num_samples = received.shape
        if not self.masked:
            return np.ones(received.shape, dtype=received.real.dtype)
        slow = hann_window(num_ramps) if self.num_axes == 2 else np.ones(num_ramps)
        return np.asarray(np.outer(slow, hann_window(num_samples)).astype(received.real.dtype))

    def _to_bins(self, signal: FrameArray) -> FrameArray:
        if self.dither is not None and self.num_axes == 2:
            dithered = dithered_transform(self.dither, signal.shape[1], signal.dtype)
            return dithered.analysis(signal)
        bins: FrameArray = fft.ifftn(signal, axes=(0, 1)[2 - self.num_axes :], norm="ortho")
        return bins

    def _from_bins(self, bins: FrameArray) -> FrameArray:
        if self.dither is not None and self.num_axes == 2:
            dithered = dithered_transform(self.dither, bins.shape[1], bins.dtype)
            return dithered.synthesis(bins)
        signal: FrameArray = fft.fftn(bins, axes=(0, 1)[2 - self.num_axes :], norm="ortho")
        return signal


def _above(bins: FrameArray, level: float) -> FrameArray:
    """Hard threshold."""
    return np.where(np.abs(bins) > level, bins, bins.dtype.type(0))


ENTRIES = tuple(
    time_domain_entry(
        name,
        label,
        position,
        f"Morphological component analysis with a{layer}.",
        partial(MorphologicalComponents, name=name, num_axes=num_axes, masked=masked),
    )
    for name, num_axes, masked, label, position, layer in (
        ("mca", 1, True, "MCA, masked", 70, "n object layer per ramp, in flagged samples"),
        (
            "mca-unmasked",
            1,
            False,
            "MCA, without mask",
            75,
            "n object layer per ramp in the place of the whole frame, as the paper compares with",
        ),
        (
            "mca-2d",
            2,
            True,
            "MCA, two-dimensional",
            80,
            " two-dimensional object layer, in flagged samples",
        ),
    )
)
