"""Victim and interferer chirp sequences, and conversions between axes and units.

The object signal is (5) of the paper, ``exp(-j 2 pi beat n) exp(-j 2 pi doppler p)``: with this
sign the beat frequency is ``slope * delay`` and a *receding* object has a positive Doppler
frequency.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_range

SPEED_OF_LIGHT_MPS = 299_792_458.0


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

    def __post_init__(self) -> None:
        """Check every value against what a radar can have."""
        require_range("start_frequency_hz", self.start_frequency_hz, 1e6, 1e13, "Hz")
        require_range("abs(slope_hz_per_s)", abs(self.slope_hz_per_s), 1e6, 1e18, "Hz/s")
        require_range("sample_rate_hz", self.sample_rate_hz, 1e2, 1e12, "Hz")
        require_range("ramp_period_s", self.ramp_period_s, 1e-9, 1e2, "s")
        require_range("num_samples", self.num_samples, 8, 65536)
        require_range("num_ramps", self.num_ramps, 1, 65536)
        require_range("lowest_beat", self.lowest_beat, -1.0, 0.0, "cycles per sample")

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
        """(P,) start times T_p p of the ramps."""
        return np.arange(self.num_ramps, dtype=np.float64) * self.ramp_period_s

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
