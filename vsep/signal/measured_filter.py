"""Measured anti-aliasing filter: complex samples over frequency.

Between the samples the response is a cubic spline. Beyond the outermost samples their value fades
to zero smoothly over one eighth of the measured band on either side, so that a response which
stops abruptly does not ring.

The modified response is that of `vsep.signal.smooth_response`.
"""

from typing import Literal

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep.errors import InputError
from vsep.signal.cubic_spline import CubicSpline
from vsep.signal.modified_response import ModifiedResponse
from vsep.signal.response_jet import ResponseJet
from vsep.signal.smooth_response import MAX_GRID, SmoothResponse

_FADE_SHARE = 0.125


class MeasuredFilter(ModifiedResponse):
    """Filter given by complex samples of its response; equal to itself only.

    Parameters
    ----------
    frequency_hz : (M,) float
        Ascending, irregular spacing allowed, at least four.
    response : (M,) complex
        G at these frequencies; a delay common to all samples is allowed.

    Raises
    ------
    InputError
        If the arrays do not fit together, are not finite or ascending, or the response is zero.

    Examples
    --------
    >>> import numpy as np
    >>> frequency_hz = np.linspace(-2e6, 2e6, 41)
    >>> measured = MeasuredFilter(
    ...     frequency_hz=frequency_hz, response=1.0 / (1.0 + 1j * frequency_hz / 1e6)
    ... )
    >>> measured.response(np.array([0.0, 1e6, 9e6])).round(6)
    array([1. +0.j , 0.5-0.5j, 0. +0.j ])
    """

    def __init__(self, *, frequency_hz: FloatArray, response: ComplexArray) -> None:
        frequency, samples = _checked(frequency_hz, response)
        self._frequency_hz = frozen(frequency)
        self._samples = frozen(samples)
        self._spline = _spline_with_fades(frequency, samples)
        low, high = self._spline.knots[[0, -1]].tolist()
        step = max(float(np.median(np.diff(frequency))) / 2.0, 2.0 * (high - low) / MAX_GRID)
        self._smooth = SmoothResponse(self._spline.jet, low, high, step)

    def __repr__(self) -> str:
        """Describe number and range of the samples."""
        low, high = self._frequency_hz[[0, -1]]
        return f"MeasuredFilter({len(self._samples)} samples from {low:g} to {high:g} Hz)"

    @property
    def kind(self) -> Literal["measured"]:
        """Name of the family."""
        return "measured"

    @property
    def frequency_hz(self) -> FloatArray:
        """(M,) frequencies of the samples."""
        return self._frequency_hz

    @property
    def samples(self) -> ComplexArray:
        """(M,) complex samples of the response."""
        return self._samples

    @property
    def cutoff_hz(self) -> float:
        """Outermost absolute frequency whose sample reaches half of the largest magnitude."""
        magnitude = np.abs(self._samples)
        return float(np.abs(self._frequency_hz[2.0 * magnitude >= magnitude.max()]).max())

    @property
    def smooth(self) -> SmoothResponse:
        """The response with its fades."""
        return self._smooth

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f), zero beyond the fades."""
        return self._spline.jet(np.asarray(frequency_hz, dtype=np.float64))[0]

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        return self.smooth.modified_response_jet(frequency_hz, slope_difference_hz_per_s)


def _checked(frequency_hz: FloatArray, response: ComplexArray) -> tuple[FloatArray, ComplexArray]:
    try:
        frequency = np.array(frequency_hz, dtype=np.float64)
        samples = np.array(response, dtype=np.complex128)
    except (TypeError, ValueError):
        raise InputError("The measured filter holds no numbers; give two numeric arrays.") from None
    if frequency.ndim != 1 or frequency.shape != samples.shape or len(frequency) < 4:
        raise InputError(
            f"The measured filter has {frequency.shape} frequencies and {samples.shape} samples; "
            "both must be one-dimensional, of one length and at least 4 long."
        )
    if not (np.all(np.isfinite(frequency)) and np.all(np.isfinite(samples))):
        raise InputError("The measured filter holds NaN or infinity; all its samples are finite.")
    if not np.all(np.diff(frequency) > 0.0):
        raise InputError("The measured filter's frequencies are not ascending; sort them.")
    if not np.any(samples):
        raise InputError("The measured filter is zero everywhere; one sample must be nonzero.")
    return frequency, samples


def _spline_with_fades(frequency: FloatArray, samples: ComplexArray) -> CubicSpline:
    """Cubic spline through the samples and through a fade to zero on either side."""
    share = np.arange(1, 9) / 8.0
    offset = share * _FADE_SHARE * (frequency[-1] - frequency[0])
    # Smooth step whose first two derivatives vanish at both ends.
    fade = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    knots = np.concatenate([frequency[0] - offset[::-1], frequency, frequency[-1] + offset])
    values = np.concatenate([samples[0] * fade[::-1], samples, samples[-1] * fade])
    return CubicSpline(knots, values)
