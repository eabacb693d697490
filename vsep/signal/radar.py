"""Victim and interferer chirp sequences, and conversions between axes and units.

The object signal is (5) of the paper, ``exp(-j 2 pi beat n) exp(-j 2 pi doppler p)``: with this
sign the beat frequency is ``slope * delay`` and a *receding* object has a positive Doppler
frequency.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.kernels.moving_atoms import STATIONARY, Migration
from vsep.signal.dithered_atoms import Coupling, RampDither

SPEED_OF_LIGHT_MPS = 299_792_458.0
FASTEST_MPS: Final = 70.0
"""Radial velocity up to which objects are looked for where range migration is modelled."""
NEGLIGIBLE_CELLS: Final = 0.002  # moved by the fastest object in a frame: satellites at -60 dB
MOST_FOLDS: Final = 2  # intervals of Doppler frequency searched to either side of the first


@dataclass(frozen=True, kw_only=True, slots=True)
class ChirpSequence:
    """Chirp sequence of the victim radar and its sampling, (2)-(4).

    Parameters
    ----------
    start_frequency_hz : float
        f_0, carrier frequency at the first sample.
    slope_hz_per_s : float
        k, chirp slope; may be negative, not zero.
    sample_rate_hz : float
        1/T_s, complex samples per second.
    ramp_period_s : float
        T_p, from one ramp's first sample to the next one's.
    num_samples : int
        N, samples per ramp.
    num_ramps : int
        P, ramps per frame.
    lowest_beat : float
        Lower edge of the unambiguous beat interval in cycles per sample, -1/2 by default. Sensors
        that sample one side of the band only (beat frequencies from 0 to the sample rate) set 0.
    range_migration : bool
        Whether objects are modelled as moving through range cells within a frame, see `migration`.
    start_times_s, start_frequencies_hz : tuple of (P,) float
        Dithering: by how much every ramp starts later than at ``T_p p``, and higher than at f_0.
        Empty where none does.

    Raises
    ------
    InputError
        If a value is outside of what a radar can have.
    """

    start_frequency_hz: float
    slope_hz_per_s: float
    sample_rate_hz: float
    ramp_period_s: float
    num_samples: int
    num_ramps: int
    lowest_beat: float = -0.5
    range_migration: bool = False
    start_times_s: tuple[float, ...] = ()
    start_frequencies_hz: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check every value against what a radar can have."""
        require_range("start_frequency_hz", self.start_frequency_hz, 1e6, 1e13, "Hz")
        require_range("abs(slope_hz_per_s)", abs(self.slope_hz_per_s), 1e6, 1e18, "Hz/s")
        require_range("sample_rate_hz", self.sample_rate_hz, 1e2, 1e12, "Hz")
        require_range("ramp_period_s", self.ramp_period_s, 1e-9, 1e2, "s")
        require_range("num_samples", self.num_samples, 8, 65536)
        require_range("num_ramps", self.num_ramps, 1, 65536)
        require_range("lowest_beat", self.lowest_beat, -1.0, 0.0, "cycles per sample")
        self._check_dithering()

    def _check_dithering(self) -> None:
        limits = {"start_times_s": (self.ramp_period_s, "s"), "start_frequencies_hz": (1e12, "Hz")}
        for name, (limit, unit) in limits.items():
            offsets = getattr(self, name)
            object.__setattr__(self, name, tuple(float(each) for each in offsets))
            if len(offsets) not in (0, self.num_ramps):
                raise InputError(
                    f"{name} holds {len(offsets)} values; it must hold one for each of the "
                    f"{self.num_ramps} ramps, or none."
                )
            for each in offsets:
                require_range(name, each, -limit, limit, unit)

    @property
    def shape(self) -> tuple[int, int]:
        """(P, N), the shape of a received frame."""
        return self.num_ramps, self.num_samples

    @property
    def sample_times_s(self) -> FloatArray:
        """(N,) fast time t' = n T_s of the samples of one ramp."""
        return np.arange(self.num_samples, dtype=np.float64) / self.sample_rate_hz

    @property
    def ramp_times_s(self) -> FloatArray:
        """(P,) start times of the ramps, T_p p and what they are dithered by."""
        times = np.arange(self.num_ramps, dtype=np.float64) * self.ramp_period_s
        return times + np.array(self.start_times_s) if self.start_times_s else times

    @property
    def ramp_frequencies_hz(self) -> FloatArray:
        """(P,) start frequencies of the ramps, f_0 and what they are dithered by."""
        offsets = np.array(self.start_frequencies_hz or np.zeros(self.num_ramps))
        return np.asarray(self.start_frequency_hz + offsets)

    @property
    def is_dithered(self) -> bool:
        """Whether some ramp starts at another time or frequency than the sequence says."""
        return any(self.start_times_s) or any(self.start_frequencies_hz)

    @property
    def one_cell_mps(self) -> float:
        """Velocity at which an object moves by one range cell, c / (2 B), in a frame P T_p."""
        swept_hz = abs(self.slope_hz_per_s) * self.num_samples / self.sample_rate_hz
        cell_m = SPEED_OF_LIGHT_MPS / (2.0 * swept_hz)
        return cell_m / (self.num_ramps * self.ramp_period_s)

    @property
    def needs_migration(self) -> bool:
        """Whether an object at `FASTEST_MPS` moves by `NEGLIGIBLE_CELLS` of a range cell."""
        return self.num_ramps > 1 and NEGLIGIBLE_CELLS * self.one_cell_mps <= FASTEST_MPS

    @property
    def migration(self) -> Coupling:
        """How delay and Doppler frequency of an object are coupled within a frame.

        By its motion and, where ramps are dithered, by their starts.
        """
        return self.dither or self.motion

    @property
    def dither(self) -> RampDither | None:
        """Starts of the ramps, and how objects move; None where ramps are equal."""
        if not self.is_dithered:
            return None
        none, samples_per_hz = (0.0,) * self.num_ramps, self.sample_rate_hz / self.slope_hz_per_s
        return RampDither(
            start_ramps=tuple(t / self.ramp_period_s for t in self.start_times_s) or none,
            start_samples=tuple(f * samples_per_hz for f in self.start_frequencies_hz) or none,
            lowest_beat=self.lowest_beat,
            motion=self.motion,
        )

    @property
    def motion(self) -> Migration:
        """How motion couples delay and Doppler frequency.

        With the delay ``tau + nu t / f_0`` the phase ``(f_0 + k n T_s)`` times the delay grows by
        ``nu (p T_p + n T_s) (1 + mu n)``, ``mu = k T_s / f_0``. There is no coupling where
        `range_migration` is off and where it is not needed, see `needs_migration`. Two Doppler
        frequencies that are one per ramp apart migrate differently, which tells them apart.
        """
        if not self.range_migration or not self.needs_migration:
            return STATIONARY
        cycles = 2.0 * FASTEST_MPS / SPEED_OF_LIGHT_MPS * self.start_frequency_hz
        folds = math.ceil(cycles * self.ramp_period_s - 0.5)
        return Migration(
            coupling=self.slope_hz_per_s / (self.sample_rate_hz * self.start_frequency_hz),
            ramp_share=1.0 / (self.sample_rate_hz * self.ramp_period_s),
            folds=min(max(folds, 0), MOST_FOLDS),
        )

    def beat_from_delay(self, delay_s: FloatArray) -> FloatArray:
        """Beat frequency k tau T_s in cycles per sample, not wrapped."""
        return np.asarray(delay_s) * (self.slope_hz_per_s / self.sample_rate_hz)

    def delay_from_beat(self, beat: FloatArray) -> FloatArray:
        """Two-way delay in s of a beat frequency, inside the unambiguous interval."""
        lowest = self.lowest_beat
        unambiguous = (np.asarray(beat, dtype=np.float64) - lowest) % 1.0 + lowest
        return np.asarray(unambiguous * (self.sample_rate_hz / self.slope_hz_per_s))

    def range_from_beat(self, beat: FloatArray) -> FloatArray:
        """Distance in m, half the two-way delay times the speed of light."""
        return self.delay_from_beat(beat) * (SPEED_OF_LIGHT_MPS / 2.0)

    def doppler_from_hz(self, doppler_hz: FloatArray) -> FloatArray:
        """Normalised Doppler frequency nu T_p in cycles per ramp, not wrapped."""
        return np.asarray(doppler_hz) * self.ramp_period_s

    def doppler_to_hz(self, doppler: FloatArray) -> FloatArray:
        """Doppler frequency in Hz of a normalised one."""
        return np.asarray(doppler) / self.ramp_period_s

    def velocity_from_doppler(self, doppler: FloatArray) -> FloatArray:
        """Radial velocity in m/s, positive for a receding object."""
        return self.doppler_to_hz(doppler) * (SPEED_OF_LIGHT_MPS / (2.0 * self.start_frequency_hz))

    def acceleration_from_curvature(self, curvature: FloatArray) -> FloatArray:
        """Radial acceleration in m/s^2; twice the curvature is the change of Doppler a ramp."""
        return self.velocity_from_doppler(2.0 * np.asarray(curvature)) / self.ramp_period_s


@dataclass(frozen=True, kw_only=True, slots=True)
class InterfererSequence:
    """Chirp sequence of the interfering radar, (6).

    Parameters
    ----------
    start_frequency_hz, slope_hz_per_s : float
        f_I and k_I.
    ramp_duration_s, ramp_period_s : float
        T_swI, while the chirp is on, and T_pI, from ramp to ramp.
    num_ramps : int
        P_I.
    time_offset_s : float
        T-bar, start of the interferer's first ramp after the victim's first sample.
    """

    start_frequency_hz: float
    slope_hz_per_s: float
    ramp_duration_s: float
    ramp_period_s: float
    num_ramps: int
    time_offset_s: float = 0.0

    def __post_init__(self) -> None:
        """Check every value against what a radar can have."""
        require_range("interferer start_frequency_hz", self.start_frequency_hz, 1e6, 1e13, "Hz")
        require_range("interferer abs(slope_hz_per_s)", abs(self.slope_hz_per_s), 0.0, 1e18, "Hz/s")
        require_range("interferer ramp_duration_s", self.ramp_duration_s, 1e-9, 1e2, "s")
        require_range("interferer ramp_period_s", self.ramp_period_s, 1e-9, 1e2, "s")
        require_range("interferer num_ramps", self.num_ramps, 1, 65536)
        require_range("interferer time_offset_s", self.time_offset_s, -1e2, 1e2, "s")
