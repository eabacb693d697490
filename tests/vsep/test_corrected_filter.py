"""The corrected filter: linear in its coefficients, and the assumed one without them."""

import numpy as np

from vsep.signal.corrected_filter import (
    NUM_SPLINES,
    CorrectedFilter,
    corrected_model,
    modified_splines,
)
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.measured_filter import MeasuredFilter
from vsep.signal.template import SignalModel

CUTOFF_HZ, SLOPE = 2.55e6, -0.8e12
ASSUMED = RaisedCosineFilter(cutoff_hz=CUTOFF_HZ)
FREQUENCY = np.linspace(-10e6, 10e6, 101)


def coefficients(seed=0):
    rng = np.random.default_rng(seed)
    return 0.1 * (rng.standard_normal(NUM_SPLINES) + 1j * rng.standard_normal(NUM_SPLINES))


def test_every_coefficient_adds_its_modified_spline():
    weights = coefficients()
    corrected = CorrectedFilter(assumed=ASSUMED, coefficients=weights)
    expected = ASSUMED.modified_response(FREQUENCY, SLOPE)
    expected = expected + modified_splines(FREQUENCY, SLOPE, CUTOFF_HZ) @ weights
    value = corrected.modified_response(FREQUENCY, SLOPE)
    # Truncated cubics reach (35 knots)^3 = 4e4 spline heights: five of 16 digits are lost.
    np.testing.assert_allclose(value, expected, rtol=0, atol=1e-10)


def test_modified_response_is_that_of_the_response():
    corrected = CorrectedFilter(assumed=ASSUMED, coefficients=coefficients())
    dense = np.linspace(-12e6, 12e6, 4001)
    sampled = MeasuredFilter(frequency_hz=dense, response=corrected.response(dense))
    value = corrected.modified_response(FREQUENCY, SLOPE)
    # Where the taper begins the response has no third derivative: between samples 6 kHz apart its
    # cubic interpolation errs by some 1e-5.
    np.testing.assert_allclose(value, sampled.modified_response(FREQUENCY, SLOPE), atol=1e-4)


def test_without_coefficients_the_model_is_itself():
    model = SignalModel(
        num_ramps=1, num_samples=64, sample_rate_hz=10.2e6, anti_aliasing_filter=ASSUMED
    )
    assert corrected_model(model, np.zeros(NUM_SPLINES, dtype=complex)) is model
    changed = corrected_model(model, coefficients()).anti_aliasing_filter
    assert changed.cutoff_hz == CUTOFF_HZ
    assert changed.kind == "raised_cosine"
