"""Assumed anti-aliasing filter plus a complex spline.

The modified response is linear in the response, so the correction of a burst is the modified
response of the spline, in closed form for every slope difference.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.filters import AntiAliasingFilter, FilterKind
from vsep.signal.measured_filter import MeasuredFilter
from vsep.signal.modified_response import (
    ModifiedResponse,
    bspline_responses,
    spline_jet,
)
from vsep.signal.response_jet import ResponseJet
from vsep.signal.smooth_response import MAX_GRID, Jet, SmoothResponse
from vsep.signal.template import SignalModel

# In cut-offs. A quarter resolves impulse responses as long as four over the cut-off; at the reach
# a filter of order 4 has fallen by 55 dB.
SPACING: Final = 0.25
REACH: Final = 4.375
STEP: Final = 1 / 16  # of the spacing: an integral over cubic pieces then errs by 16^-4 of them
NUM_KNOTS: Final = int(2.0 * REACH / SPACING) + 1
NUM_SPLINES: Final = NUM_KNOTS - 4
_FOURTH_DIFFERENCE: Final = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


@dataclass(frozen=True, kw_only=True, eq=False)
class CorrectedFilter(ModifiedResponse):
    """An assumed filter plus cubic B-splines on a regular grid of frequencies.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> assumed = RaisedCosineFilter(cutoff_hz=1e6)
    >>> ones = np.ones(NUM_SPLINES, dtype=complex)  # B-splines on a regular grid sum to one
    >>> CorrectedFilter(assumed=assumed, coefficients=ones).response(np.array([0.0, 2e6])).real
    array([2., 1.])
    """

    assumed: AntiAliasingFilter  #: with a finite cut-off
    #: (NUM_SPLINES,) weights of the splines, from the lowest frequency up; a spline's peak is 2/3
    coefficients: ComplexArray

    @property
    def kind(self) -> FilterKind:
        """Name of the assumed filter's family."""
        return self.assumed.kind

    @property
    def cutoff_hz(self) -> float:
        """Half-amplitude frequency of the assumed filter."""
        return self.assumed.cutoff_hz

    @cached_property
    def _jumps(self) -> tuple[FloatArray, ComplexArray]:
        """Knots in Hz at which the spline's third derivative jumps, and by how much, 1/Hz^3."""
        jumps = np.convolve(self.coefficients, _FOURTH_DIFFERENCE)
        used = jumps != 0.0
        return knots_hz(self.cutoff_hz)[used], jumps[used] / (SPACING * self.cutoff_hz) ** 3

    @cached_property
    def smooth(self) -> SmoothResponse | None:
        """Both parts together where the assumed one is sampled, too."""
        if not isinstance(self.assumed, MeasuredFilter):
            return None
        own, (first, *_, last) = self.assumed.smooth, self._jumps[0].tolist()
        step = min(own.step_hz, STEP * SPACING * self.cutoff_hz)
        low, high = min(own.low_hz, first), max(own.high_hz, last)
        return SmoothResponse(
            self._sampled_jet, low, high, max(step, 2.0 * (high - low) / MAX_GRID)
        )

    def _sampled_jet(self, frequency_hz: FloatArray) -> Jet:
        assert isinstance(self.assumed, MeasuredFilter)
        value, first, second = self._spline(frequency_hz, 3)
        own = self.assumed.smooth.jet(frequency_hz)
        return own[0] + value, own[1] + first, own[2] + second

    def _spline(self, frequency_hz: FloatArray, orders: int) -> list[ComplexArray]:
        """Return the spline and its derivatives up to an order below the given one."""
        knots, jumps = self._jumps
        offsets = np.maximum(np.asarray(frequency_hz)[..., None] - knots, 0.0)
        inside = np.abs(frequency_hz) < REACH * self.cutoff_hz  # beyond, only rounding is left
        powers = (offsets ** (3 - n) / math.factorial(3 - n) for n in range(orders))
        return [np.where(inside, power @ jumps, 0.0) for power in powers]

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Complex response G(f)."""
        return np.asarray(self.assumed.response(frequency_hz) + self._spline(frequency_hz, 1)[0])

    def modified_response_jet(
        self, frequency_hz: FloatArray, slope_difference_hz_per_s: FloatArray | float
    ) -> ResponseJet:
        """Gbar with derivatives by f; `InputError` for a slope difference of zero."""
        if self.smooth is not None:
            return self.smooth.modified_response_jet(frequency_hz, slope_difference_hz_per_s)
        assumed = self.assumed.modified_response_jet(frequency_hz, slope_difference_hz_per_s)
        knots, jumps = self._jumps
        spline = spline_jet(frequency_hz, slope_difference_hz_per_s, knots, jumps)
        return ResponseJet(*(own + more for own, more in zip(assumed, spline, strict=True)))


def corrected_model(model: SignalModel, coefficients: ComplexArray) -> SignalModel:
    """Return the model with its filter corrected; the model itself if all coefficients are zero."""
    if not np.any(coefficients):
        return model
    corrected = CorrectedFilter(assumed=model.anti_aliasing_filter, coefficients=coefficients)
    return replace(model, anti_aliasing_filter=corrected)


def knots_hz(cutoff_hz: float) -> FloatArray:
    """(NUM_KNOTS,) knots of the splines."""
    return np.asarray((np.arange(NUM_KNOTS) * SPACING - REACH) * cutoff_hz)


def modified_splines(
    frequency_hz: FloatArray, slope_hz_per_s: FloatArray | float, cutoff_hz: float
) -> ComplexArray:
    """Return the modified responses of all splines: what a coefficient adds to a burst's envelope.

    Parameters
    ----------
    frequency_hz, slope_hz_per_s : float arrays that broadcast
        Where to evaluate, and the slope difference Delta k, not zero.
    cutoff_hz : float
        Sets the grid.

    Returns
    -------
    (..., NUM_SPLINES) complex
    """
    return bspline_responses(frequency_hz, slope_hz_per_s, knots_hz(cutoff_hz))
