"""Courses of chirps over the time of a frame: what the crossing view draws and what a drag means.

The course of another radar's chirp in a ramp is the difference of its frequency and the victim's
own, (39) of the paper: a straight line. A burst is where it lies within the pass band.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.core.state import SeparationState
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import GroundTruth
from vsep.signal.spectra import spectrogram
from vsep.units import to_db
from vsep_app.model.static_picture import ByteArray, StaticPicture

SWEEP_BANDS = 4.0  # a ramp rises by so many half-widths of the band on the drawing
REACH_BANDS = 2.2  # courses are drawn so far beyond the middle of the band
_SPECTROGRAM_DB = 45.0
_WINDOWS_A_RAMP = 8
_LEAST_WINDOW = 16
ALL_RAMPS, SPECTROGRAM = "ramps", "spectrogram"


@dataclass(frozen=True, kw_only=True, eq=False)
class Courses:
    """Courses of chirps relative to the victim's, each in one ramp."""

    ramps: IntArray  #: (B,) int
    starts_mhz: FloatArray  #: (B,) float: Intermediate frequency at the ramp's first sample.
    slopes: FloatArray  #: (B,) float: In MHz/us; 0 for a chirp with the victim's slope.

    def at(self, times_us: FloatArray) -> FloatArray:
        """(B,) intermediate frequencies in MHz at a fast time of each."""
        return self.starts_mhz + self.slopes * times_us

    def within(self, limit_mhz: float, ramp_us: float) -> tuple[FloatArray, FloatArray]:
        """(B,) first and last fast time in the ramp within +-limit; first > last if never."""
        flat = self.slopes == 0.0
        slopes = np.where(flat, 1.0, self.slopes)
        middle, half = -self.starts_mhz / slopes, limit_mhz / np.abs(slopes)
        never = np.where(np.abs(self.starts_mhz) <= limit_mhz, 0.0, np.inf)
        first = np.where(flat, never, np.maximum(middle - half, 0.0))
        return first, np.where(flat, ramp_us, np.minimum(middle + half, ramp_us))

    def pivots_us(self, ramp_us: float) -> FloatArray:
        """(B,) fast times at which they cross the victim's chirp, perhaps beyond the ramp.

        That is the middle of the ramp for a chirp of the victim's slope, which never does.
        """
        flat = self.slopes == 0.0
        times = -self.starts_mhz / np.where(flat, 1.0, self.slopes)
        return np.where(flat, 0.5 * ramp_us, times)

    def crossings_us(self, ramp_us: float) -> FloatArray:
        """(B,) the same, those of a chirp that crosses beyond the ramp at its nearer end."""
        return np.clip(self.pivots_us(ramp_us), 0.0, ramp_us)

    def handles_us(self, limit_mhz: float, ramp_us: float) -> FloatArray:
        """(B,) fast times of that end within +-limit which is farther from the crossing."""
        first, last = self.within(limit_mhz, ramp_us)
        pivots = self.pivots_us(ramp_us)
        is_last = np.abs(last - pivots) >= np.abs(first - pivots)
        return np.where(np.isfinite(first), np.where(is_last, last, first), 0.0)


@dataclass(frozen=True, kw_only=True)
class CrossingPlane:
    """Axes of the crossing view: all ramps side by side, or one ramp with its spectrogram.

    Side by side, pauses between ramps are left out, and the sweep that both radars have in common
    is drawn shortened: distances between chirps are true, the rise of a ramp is not.
    """

    num_ramps: int
    ramp_us: float  #: Duration of the samples of a ramp.
    band_mhz: float  #: Half-width of the pass band.
    nyquist_mhz: float  #: Half of the sampling rate.
    victim_slope: float  #: Of the victim's own chirp, in MHz/us.
    ramp: int | None = None  #: The one that is shown alone; None: all.

    @property
    def sweep_mhz(self) -> float:
        """Rise of a ramp on the drawing."""
        rise = 0.0 if self.ramp is not None else SWEEP_BANDS * self.band_mhz
        return rise if self.victim_slope > 0.0 else -rise

    @property
    def reach_mhz(self) -> float:
        """So far from the victim's chirp courses are drawn."""
        return self.nyquist_mhz if self.ramp is not None else REACH_BANDS * self.band_mhz

    @property
    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ends of both axes."""
        across = (0.0, self.ramp_us) if self.ramp is not None else (0.0, float(self.num_ramps))
        lowest, highest = sorted((0.0, self.sweep_mhz))
        return across, (lowest - self.reach_mhz, highest + self.reach_mhz)

    def place(
        self, ramps: IntArray, times_us: FloatArray, frequencies_mhz: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return both coordinates of intermediate frequencies at fast times of ramps."""
        share = np.asarray(times_us) / self.ramp_us
        across = times_us if self.ramp is not None else ramps + share
        return np.asarray(across), np.asarray(frequencies_mhz + self.sweep_mhz * share)

    def read(self, x: float, y: float, ramp: int) -> tuple[float, float]:
        """Return fast time, counted from the start of a ramp, and intermediate frequency there."""
        time_us = x if self.ramp is not None else (x - ramp) * self.ramp_us
        return time_us, y - self.sweep_mhz * time_us / self.ramp_us


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossing:
    """All that the crossing view draws of one iteration."""

    plane: CrossingPlane
    true: Courses  #: Of the simulated chirps; empty where they are not known.
    found: Courses  #: Of the bursts that are modelled.
    #: (B,) bool: Which of them have a true chirp in the band where they cross; None: not known.
    is_true: BoolArray | None
    image: ByteArray | None = None  #: (M, N) uint8: Spectrogram of the ramp that is shown alone.


def crossing_of(
    static_picture: StaticPicture, state: SeparationState, *, ramp: int, mode: str
) -> Crossing:
    """Return what the crossing view draws of a state.

    `mode` is `ALL_RAMPS` or `SPECTROGRAM`; of a spectrogram only courses of the ramp are shown.
    """
    radar = static_picture.radar
    alone = ramp if mode == SPECTROGRAM else None
    plane = CrossingPlane(
        num_ramps=radar.num_ramps,
        ramp_us=radar.num_samples / radar.sample_rate_hz * 1e6,
        band_mhz=static_picture.band_hz / 1e6,
        nyquist_mhz=radar.sample_rate_hz / 2e6,
        victim_slope=radar.slope_hz_per_s / 1e12,
        ramp=alone,
    )
    true = _true_courses(static_picture.observation.truth, alone)
    found = _found_courses(radar, state, alone)
    return Crossing(
        plane=plane,
        true=true,
        found=found,
        is_true=None
        if static_picture.observation.truth is None
        else _are_true(found, true, plane.band_mhz, plane.ramp_us),
        image=None
        if alone is None
        else spectrogram_image(static_picture.observation.received[ramp]),
    )


def _true_courses(truth: GroundTruth | None, alone: int | None) -> Courses:
    bursts = [
        burst
        for burst in (() if truth is None else truth.bursts)
        if alone is None or burst.ramp == alone
    ]
    return _courses(
        [burst.ramp for burst in bursts],
        [burst.start_frequency_hz / 1e6 for burst in bursts],
        [burst.slope_hz_per_s / 1e12 for burst in bursts],
    )


def _found_courses(radar: ChirpSequence, state: SeparationState, alone: int | None) -> Courses:
    bursts = [burst for burst in state.bursts if alone is None or burst.ramp == alone]
    rate_mhz = radar.sample_rate_hz / 1e6
    return _courses(
        [burst.ramp for burst in bursts],
        [burst.start_frequency * rate_mhz for burst in bursts],
        [burst.slope * rate_mhz**2 for burst in bursts],
    )


def _courses(ramps: list[int], starts_mhz: list[float], slopes: list[float]) -> Courses:
    return Courses(
        ramps=np.array(ramps, dtype=np.int64),
        starts_mhz=np.array(starts_mhz, dtype=np.float64),
        slopes=np.array(slopes, dtype=np.float64),
    )


def _are_true(found: Courses, true: Courses, band_mhz: float, ramp_us: float) -> BoolArray:
    """(B,) whether a true chirp is within the band where a burst that is found crosses."""
    times = found.crossings_us(ramp_us)
    there = true.starts_mhz + np.multiply.outer(times, true.slopes)
    same = np.equal.outer(found.ramps, true.ramps)
    return np.asarray(np.any(same & (np.abs(there) <= band_mhz), axis=1), dtype=np.bool_)


def spectrogram_image(received: ComplexArray) -> ByteArray:
    """(M, N) uint8: spectrogram of a ramp, its largest value 255, frequencies ascending."""
    window = min(max(_LEAST_WINDOW, len(received) // _WINDOWS_A_RAMP), len(received))
    power = spectrogram(received, window).power.T
    levels = to_db(power / max(float(power.max()), np.finfo(float).tiny))
    return np.asarray(
        np.round(np.clip(1.0 + levels / _SPECTROGRAM_DB, 0.0, 1.0) * 255.0), dtype=np.uint8
    )
