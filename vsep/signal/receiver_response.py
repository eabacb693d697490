"""Measured response of a receiver: complex samples over frequency for every antenna.

Anti-aliasing filter, high-pass and delays are all in it. A burst does not show the delay and the
phase that all antennas share, nor the gain of an antenna: they go into the burst's own crossing
time and weights. The shared delay is therefore zero on average over power, the largest magnitude
of every antenna is one.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep.errors import InputError
from vsep.signal.measured_filter import MeasuredFilter


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ReceiverResponse:
    """Sampled complex response of every antenna of a receiver, in the paper's sign.

    Raises `InputError` if the arrays do not fit together or cannot be a filter.

    Examples
    --------
    >>> import numpy as np
    >>> frequency_hz = np.linspace(-4e6, 4e6, 9)
    >>> delayed = np.exp(-2j * np.pi * frequency_hz * 50e-9)[None]
    >>> response = ReceiverResponse(frequency_hz=frequency_hz, response=delayed,
    ...                             coherence=np.ones((1, 9)), num_bursts=8,
    ...                             slope_difference_hz_per_s=2e13)
    >>> response.delays_s.round(12)
    array([5.e-08])
    """

    frequency_hz: FloatArray  #: (F,) ascending
    response: ComplexArray  #: (A, F) G of every antenna
    #: (A, F) from 0 to 1: how much of the bursts' spectrum at a frequency the response explains
    coherence: FloatArray
    #: at which it was measured. An error of this value is a quadratic phase of the response,
    #: harmless for bursts of the same slope difference only.
    slope_difference_hz_per_s: float
    num_bursts: int  #: of how many bursts it is the common part

    def __post_init__(self) -> None:
        """Check that every antenna's samples make a filter, and freeze the arrays."""
        frequency = np.array(self.frequency_hz, dtype=np.float64)
        response = np.array(self.response, dtype=np.complex128)
        coherence = np.array(self.coherence, dtype=np.float64)
        if response.ndim != 2 or len(response) == 0 or coherence.shape != response.shape:
            raise InputError(
                f"The response has shape {response.shape} and its coherence {coherence.shape}; "
                "both must be (antennas, frequencies)."
            )
        if not (np.all(coherence >= 0.0) and np.all(coherence <= 1.0)):
            raise InputError("The coherence leaves the range; all of it must lie between 0 and 1.")
        for samples in response:
            MeasuredFilter(frequency_hz=frequency, response=samples)
        object.__setattr__(self, "frequency_hz", frozen(frequency))
        object.__setattr__(self, "response", frozen(response))
        object.__setattr__(self, "coherence", frozen(coherence))

    @property
    def num_antennas(self) -> int:
        """A."""
        return len(self.response)

    @property
    def delays_s(self) -> FloatArray:
        """(A,) mean group delay of every antenna over its power; their differences are measured."""
        # The phase between neighbouring frequencies, weighted by their power.
        products = np.sum(self.response[:, 1:] * self.response[:, :-1].conj(), axis=1)
        step_hz = np.mean(np.diff(self.frequency_hz))
        return np.asarray(-np.angle(products) / (2.0 * np.pi * step_hz))

    def filter_of(self, antenna: int) -> MeasuredFilter:
        """Return the filter that an estimator assumes for one antenna.

        Raises `InputError` if there is no such antenna.
        """
        if not 0 <= antenna < self.num_antennas:
            raise InputError(
                f"antenna is {antenna}; the response has antennas 0 to {self.num_antennas - 1}."
            )
        return MeasuredFilter(frequency_hz=self.frequency_hz, response=self.response[antenna])
