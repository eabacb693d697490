"""Anti-aliasing filters: response G(f) and modified response Gbar(f; Delta k).

Every filter states the frequency at which its magnitude is one half (-6 dB), whatever its kind, so
that filters of different kinds with one cut-off are comparable. G is the complex response of the
complex baseband receiver at positive and negative frequencies. The closed forms of Gbar stand in
`vsep.signal.modified_response`, the measured filter in `vsep.signal.measured_filter`.
"""

import math
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.signal.measured_filter import MeasuredFilter
from vsep.signal.modified_response import ModifiedResponse, pole_jet, raised_cosine_jet
from vsep.signal.response_jet import ResponseJet
from vsep.signal.smooth_response import SmoothResponse

__all__ = [
    "AntiAliasingFilter",
    "ButterworthFilter",
    "FilterKind",
    "MeasuredFilter",
    "NoFilter",
    "RaisedCosineFilter",
    "ResponseJet",
]

FilterKind: TypeAlias = Literal["raised_cosine", "butterworth", "none", "measured"]
_MIN_CUTOFF_HZ = 1.0
_MAX_CUTOFF_HZ = 1e12


class AntiAliasingFilter(Protocol):
    """Protocol of a filter for the simulator and the estimators."""

    @property
    def kind(self) -> FilterKind:
        """Name of the family, as frame files spell it."""

    @property
    def cutoff_hz(self) -> float:
        """Frequency at which the magnitude is one half; infinite without a filter."""

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f)."""

    def modified_response(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ComplexArray:
        """Return the modified response Gbar(f; Delta k) of (40)-(41); the arguments broadcast."""

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Return the modified response with its first two derivatives by the frequency."""

    @property
    def smooth(self) -> SmoothResponse | None:
        """The response as a smooth one of finite support, where it is given by samples."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RaisedCosineFilter(ModifiedResponse):
    """Raised cosine of zero phase, the filter of Sec. IV.

    G = 1 up to (1 - rolloff) cutoff, a half cosine down to 0 at (1 + rolloff) cutoff. One half at
    the cut-off, which the paper calls the Nyquist bandwidth.

    Parameters
    ----------
    cutoff_hz : float
        Half-amplitude frequency.
    rolloff : float
        From 0.01 to 1. A brick wall (0) has no second derivative and is refused.

    Raises
    ------
    InputError
        If a value is outside of its range.

    Examples
    --------
    >>> import numpy as np
    >>> RaisedCosineFilter(cutoff_hz=1e6).response(np.array([0.0, 1e6, 2e6])).real
    array([1. , 0.5, 0. ])
    """

    cutoff_hz: float
    rolloff: float = 0.25

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_range("filter cutoff", self.cutoff_hz, _MIN_CUTOFF_HZ, _MAX_CUTOFF_HZ, "Hz")
        require_range("filter rolloff", self.rolloff, 0.01, 1.0)

    @property
    def kind(self) -> FilterKind:
        """Name of the family."""
        return "raised_cosine"

    @property
    def inner_hz(self) -> float:
        """End of the flat part."""
        return (1.0 - self.rolloff) * self.cutoff_hz

    @property
    def outer_hz(self) -> float:
        """Start of the stop band, where G is zero."""
        return (1.0 + self.rolloff) * self.cutoff_hz

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f); its imaginary part is zero."""
        width = self.outer_hz - self.inner_hz
        beyond = np.clip((np.abs(frequency_hz) - self.inner_hz) / width, 0.0, 1.0)
        return np.asarray(0.5 + 0.5 * np.cos(np.pi * beyond), dtype=np.complex128)

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        return raised_cosine_jet(
            frequency_hz, slope_difference_hz_per_s, self.inner_hz, self.outer_hz
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ButterworthFilter(ModifiedResponse):
    """Causal analogue Butterworth low-pass with its phase, the mismatched filter of Sec. IV-B.

    |G|^2 = 1 / (1 + 3 (f/cutoff)^(2 order)): the usual -3 dB frequency lies at
    cutoff / 3^(1/(2 order)), which puts one half at the cut-off as for the other kinds.

    Parameters
    ----------
    cutoff_hz : float
        Half-amplitude frequency.
    order : int
        From 1 to 16. Partial fractions lose about a digit in two orders: 10^-11 left at 16.

    Raises
    ------
    InputError
        If a value is outside of its range.

    Examples
    --------
    >>> import numpy as np
    >>> np.abs(ButterworthFilter(cutoff_hz=1e6, order=8).response(np.array([0.0, 1e6]))).round(12)
    array([1. , 0.5])
    """

    cutoff_hz: float
    order: int = 8

    def __post_init__(self) -> None:
        """Check the ranges."""
        require_range("filter cutoff", self.cutoff_hz, _MIN_CUTOFF_HZ, _MAX_CUTOFF_HZ, "Hz")
        require_range("filter order", self.order, 1, 16)
        if self.order != int(self.order):
            raise InputError(f"filter order is {self.order:g}; it must be an integer, 1 to 16.")

    @property
    def kind(self) -> FilterKind:
        """Name of the family."""
        return "butterworth"

    @property
    def poles(self) -> ComplexArray:
        """(order,) poles in rad/s, on the left half of a circle."""
        radius = 2.0 * np.pi * self.cutoff_hz / 3.0 ** (0.5 / self.order)
        angle = np.pi * (0.5 + (np.arange(self.order) + 0.5) / self.order)
        return np.asarray(radius * np.exp(1j * angle))

    @property
    def residues(self) -> ComplexArray:
        """(order,) residues of G in rad/s: the weights of exp(pole t) in the impulse response."""
        radius = 2.0 * np.pi * self.cutoff_hz / 3.0 ** (0.5 / self.order)
        unit_poles = self.poles / radius
        distances = unit_poles[:, None] - unit_poles[None, :]
        np.fill_diagonal(distances, 1.0)
        return np.asarray(radius / np.prod(distances, axis=1))

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f), from the product over the poles."""
        response = np.ones(np.shape(frequency_hz), dtype=np.complex128)
        for pole in self.poles:
            response *= np.abs(pole) / (2j * np.pi * np.asarray(frequency_hz) - pole)
        return response

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        return pole_jet(frequency_hz, slope_difference_hz_per_s, self.poles, self.residues)


@dataclass(frozen=True, kw_only=True, slots=True)
class NoFilter(ModifiedResponse):
    """No filter at all: G = Gbar = 1, bursts are chirps over the whole ramp and alias."""

    @property
    def kind(self) -> FilterKind:
        """Name of the family."""
        return "none"

    @property
    def cutoff_hz(self) -> float:
        """Infinite."""
        return math.inf

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """One at every frequency."""
        return np.ones(np.shape(frequency_hz), dtype=np.complex128)

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """One, with derivatives of zero."""
        shape = np.broadcast_shapes(np.shape(frequency_hz), np.shape(slope_difference_hz_per_s))
        zero = np.zeros(shape, dtype=np.complex128)
        return ResponseJet(np.ones(shape, dtype=np.complex128), zero, zero.copy())
