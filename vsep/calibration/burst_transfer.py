"""Measured bursts put into another measurement, the steps of the paper's Appendix C.

A sensor that sees a static scene and an interferer gives bursts alone: the mean over the ramps that
are not hit is the static scene, what is left in hit samples are bursts. A digital filter that
dominates the unknown receiver makes the response known that an estimator is to assume; then the
bursts are added to a frame of the same size that has none.
"""

from typing import Final, NamedTuple

import numpy as np
from scipy.signal import butter, sosfilt, sosfreqz

from vsep._typing import BoolArray, ComplexArray, FloatArray, frozen
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.signal.measured_filter import MeasuredFilter
from vsep.signal.scene import GroundTruth
from vsep.units import from_db

ORDER: Final = 8
HIGH_PASS_HZ, LOW_PASS_HZ = 0.5e6, 5e6  # Appendix C
_RESPONSE_SAMPLES = 1601


class Transferred(NamedTuple):
    """A frame with bursts of another measurement."""

    received: ComplexArray  #: (P, N)
    truth: GroundTruth  #: as far as it is known: both signals
    anti_aliasing_filter: MeasuredFilter  #: that an estimator is to assume


def measured_bursts(received: ComplexArray, mask: BoolArray) -> ComplexArray:
    """Return the bursts of a measurement of a static scene.

    Parameters
    ----------
    received : (P, N) complex
        The measurement.
    mask : (P, N) bool
        True where a sample is interfered.

    Returns
    -------
    (P, N) complex
        Zero outside of the mask.

    Raises
    ------
    InputError
        If some fast time is interfered in every ramp.

    Examples
    --------
    >>> frame = np.ones((4, 3), dtype=complex)
    >>> frame[1, 2] += 5.0
    >>> measured_bursts(frame, frame.real > 2.0)[1].real
    array([0., 0., 5.])
    """
    clean = np.count_nonzero(~mask, axis=0)
    if not np.all(clean):
        at = int(np.argmin(clean))
        raise InputError(f"Sample {at} is interfered in every ramp; at least one must be clean.")
    static = np.where(mask, 0.0, received).sum(axis=0) / clean
    return np.where(mask, received - static, 0.0)


def transferred_frame(
    received: ComplexArray,
    bursts: ComplexArray,
    sample_rate_hz: float,
    *,
    high_pass_hz: float = HIGH_PASS_HZ,
    low_pass_hz: float = LOW_PASS_HZ,
    sir_db: float | None = None,
) -> Transferred:
    """Add bursts to a frame, through a known filter.

    Parameters
    ----------
    received : (P, N) complex
        A frame without interference.
    bursts : (P, N) complex
        Of `measured_bursts`, sampled as the frame is.
    sample_rate_hz : float
        Of both.
    high_pass_hz, low_pass_hz : float
        -3 dB frequencies of Butterworth filters of order 8, below half of the sampling rate.
    sir_db : float, optional
        Energy of the frame over that of the bursts; their own level if None.

    Returns
    -------
    Transferred
        The frame, its truth as far as it is known, and the filter that an estimator is to assume.

    Raises
    ------
    InputError
        If shapes differ, there is no burst, or a frequency is out of its range.
    """
    if bursts.shape != received.shape:
        raise InputError(
            f"The bursts have shape {bursts.shape}; it must be that of the frame, {received.shape}."
        )
    rate_hz = sample_rate_hz
    require_range("high_pass_hz", high_pass_hz, 1e-6 * rate_hz, 0.49 * rate_hz, "Hz")
    require_range("low_pass_hz", low_pass_hz, high_pass_hz, 0.49 * rate_hz, "Hz")
    sections = np.concatenate(
        [
            butter(ORDER, high_pass_hz, "highpass", fs=rate_hz, output="sos"),
            butter(ORDER, low_pass_hz, "lowpass", fs=rate_hz, output="sos"),
        ]
    )
    added = np.asarray(sosfilt(sections, bursts, axis=1))
    energy = float(np.sum(np.abs(added) ** 2))
    if energy == 0.0:
        raise InputError("There is no burst; the mask of the measurement flags nothing.")
    if sir_db is not None:
        wanted = float(np.sum(np.abs(received) ** 2)) / float(from_db(sir_db))
        added = added * np.sqrt(wanted / energy)
    truth = GroundTruth(
        beats=frozen(np.zeros(0)),
        dopplers=frozen(np.zeros(0)),
        amplitudes=frozen(np.zeros(0, dtype=np.complex128)),
        object_signal=frozen(np.array(received)),
        interference_signal=frozen(added),
        bursts=(),
        noise_precision=float("nan"),
    )
    return Transferred(frozen(received + added), truth, _assumed(sections, rate_hz))


def _assumed(sections: FloatArray, rate_hz: float) -> MeasuredFilter:
    """Return the response of the digital filters over both halves of the band."""
    frequency_hz = np.linspace(-0.5, 0.5, _RESPONSE_SAMPLES) * rate_hz
    _, response = sosfreqz(sections, worN=frequency_hz, fs=rate_hz)
    return MeasuredFilter(frequency_hz=frequency_hz, response=np.asarray(response))
