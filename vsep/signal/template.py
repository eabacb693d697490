"""Burst template U(theta), (12), and the signal model that an estimator assumes.

Inside the estimator every frequency is in cycles per sample and every slope in cycles per sample
squared. One burst is ``a(n) = exp(j 2 pi (f n + s n^2 / 2)) Gbar(f + s n; s)`` with the start
frequency f and the slope s; it crosses zero frequency at the sample ``-f / s``.
"""

import math
from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.kernels.moving_atoms import STATIONARY
from vsep.kernels.templates import burst_courses, template_jets
from vsep.signal.dithered_atoms import Coupling
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.sampled_bursts import sampled_bursts

CHANNEL_GRID_FACTOR = 2  # the paper's grid has K = 2N bins


@dataclass(frozen=True, kw_only=True, slots=True)
class SignalModel:
    """Size and sampling of a frame, and the anti-aliasing filter the estimator assumes.

    Parameters
    ----------
    num_ramps, num_samples : int
        P and N.
    sample_rate_hz : float
        Complex samples per second.
    anti_aliasing_filter : AntiAliasingFilter
        The assumed filter; the one that shaped the frame may be another.
    num_antennas : int
        A, receive antennas of one transmitter. They see the same objects and bursts with weights of
        their own and equally strong noise. Inside an estimator the frame (A, P, N) is one of A P
        rows (A P, N), antenna after antenna.
    migration : Coupling
        How objects move through range cells within the frame, or how its ramps are dithered; by
        default neither.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> model = SignalModel(num_ramps=1, num_samples=256, sample_rate_hz=10.2e6,
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.55e6, rolloff=0.25))
    >>> model.template(np.array([0.98]), np.array([-0.0077])).shape
    (1, 256)
    """

    num_ramps: int
    num_samples: int
    sample_rate_hz: float
    anti_aliasing_filter: AntiAliasingFilter
    num_antennas: int = 1
    migration: Coupling = STATIONARY

    def __post_init__(self) -> None:
        """Check the size and the sampling rate."""
        require_range("num_antennas", self.num_antennas, 1, 1024)
        require_range("num_ramps", self.num_ramps, 1, 65536)
        require_range("num_samples", self.num_samples, 8, 65536)
        require_range("sample_rate_hz", self.sample_rate_hz, 1e2, 1e12, "Hz")

    @classmethod
    def of_radar(
        cls, radar: ChirpSequence, anti_aliasing_filter: AntiAliasingFilter, num_antennas: int = 1
    ) -> "SignalModel":
        """Model of the frames of a radar, with the filter to assume."""
        return cls(
            num_ramps=radar.num_ramps,
            num_samples=radar.num_samples,
            sample_rate_hz=radar.sample_rate_hz,
            anti_aliasing_filter=anti_aliasing_filter,
            num_antennas=num_antennas,
            migration=radar.migration,
        )

    @property
    def is_stationary(self) -> bool:
        """Whether objects stay in their range cells, and ramps are equal."""
        return self.migration.coupling == 0.0

    @property
    def shape(self) -> tuple[int, int]:
        """(P, N)."""
        return self.num_ramps, self.num_samples

    @property
    def rows_shape(self) -> tuple[int, int]:
        """(A P, N), the rows of all antennas; that of the frame where there is one."""
        return self.num_antennas * self.num_ramps, self.num_samples

    @property
    def num_grid_bins(self) -> int:
        """Size K of the channel grid of one ramp."""
        return CHANNEL_GRID_FACTOR * self.num_samples

    @property
    def normalised_cutoff(self) -> float:
        """Half-amplitude edge of the filter in cycles per sample, at most 1/2."""
        return min(self.anti_aliasing_filter.cutoff_hz / self.sample_rate_hz, 0.5)

    def check(self, received: ComplexArray) -> ComplexArray:
        """Return `received` as a read-only complex array of its rows, (P, N) or (A P, N).

        Parameters
        ----------
        received : (P, N) or (A, P, N) complex
            The frame, or its rows already.

        Raises
        ------
        InputError
            If the shape differs, a sample is not finite, or there is no signal at all.
        """
        array = np.asarray(received, dtype=np.complex128)
        shape = self.shape if self.num_antennas == 1 else (self.num_antennas, *self.shape)
        if array.shape not in (shape, self.rows_shape):
            raise InputError(f"received has shape {array.shape}; it must be {shape}.")
        owned = array.flags.c_contiguous and array.base is None and not array.flags.writeable
        if not owned:
            array = np.array(array, order="C")
        if array.shape != self.rows_shape:
            array = array.reshape(self.rows_shape)
        parts = array.view(np.float64)
        largest = max(float(parts.max()), -float(parts.min()))  # NaN if any is
        if not math.isfinite(largest):
            bad = np.count_nonzero(~np.isfinite(array))
            raise InputError(
                f"received holds {bad} samples that are NaN or infinite; all must be finite."
            )
        if largest == 0.0:
            raise InputError("received is zero everywhere; at least one sample must not be.")
        if not 1e-99 < largest < 1e99:
            peak = float(np.abs(array).max())
            require_range("The largest magnitude in received", peak, 1e-100, 1e100)
        return frozen(array)

    def template(self, start_frequency: FloatArray, slope: FloatArray) -> ComplexArray:
        """Burst templates (12).

        Parameters
        ----------
        start_frequency, slope : (B,) float
            Cycles per sample and cycles per sample squared.

        Returns
        -------
        (B, N) complex
            The diagonals of U.
        """
        return self.template_jet(start_frequency, slope, np.zeros_like(slope))[0]

    def template_jet(
        self,
        start_frequency: FloatArray | float,
        slope: FloatArray | float,
        reference: FloatArray | float,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Templates and their derivatives by (frequency at `reference`, slope).

        The constant phase of the template is free (the channel weights absorb it), so the
        derivatives are those of the template whose phase stands still at the reference sample.

        Parameters
        ----------
        start_frequency, slope : float or (B,) float
            Cycles per sample and cycles per sample squared.
        reference : float or (B,) float
            Sample at which the frequency is the first parameter; the burst's centre conditions
            the two parameters best.

        Returns
        -------
        template : (N,) or (B, N) complex
        derivatives : (2, N) or (B, 2, N) complex
        """
        if np.ndim(slope) == 0:
            one = (np.array([float(each)]) for each in (start_frequency, slope, reference))
            templates, derivatives = self.template_jets(*one)
            return templates[0], derivatives[0]
        return self.template_jets(
            np.asarray(start_frequency), np.asarray(slope), np.asarray(reference)
        )

    def template_jets(
        self, start_frequency: FloatArray, slope: FloatArray, reference: FloatArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """`template_jet` of several bursts, (B,) arrays."""
        rate = self.sample_rate_hz
        if self.anti_aliasing_filter.smooth is not None:
            bursts = sampled_bursts(
                self.anti_aliasing_filter.smooth,
                (start_frequency, slope, reference),
                rate,
                self.num_samples,
            )
            if bursts is not None:
                return bursts[0], np.ascontiguousarray(bursts[1:].swapaxes(0, 1))
        courses_hz, steepness = burst_courses(start_frequency, slope, rate, self.num_samples)
        jet = self.anti_aliasing_filter.modified_response_jet(courses_hz, steepness)
        return template_jets((start_frequency, slope, reference), rate, *jet)
