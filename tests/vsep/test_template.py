"""The burst template (12) and its derivatives."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.filters import ButterworthFilter, NoFilter, RaisedCosineFilter
from vsep.signal.template import SignalModel

RATE = 5.1e6
FILTERS = [
    RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    ButterworthFilter(cutoff_hz=RATE / 4, order=8),
    NoFilter(),
]


def model_with(anti_aliasing_filter, num_samples=128):
    return SignalModel(
        num_ramps=2,
        num_samples=num_samples,
        sample_rate_hz=RATE,
        anti_aliasing_filter=anti_aliasing_filter,
    )


@pytest.mark.parametrize("anti_aliasing_filter", FILTERS, ids=lambda f: f.kind)
def test_template_is_chirp_times_modified_response(anti_aliasing_filter):
    start, slope = 0.8, -0.0125
    n = np.arange(128)
    chirp = np.exp(2j * np.pi * (start * n + slope * n**2 / 2))
    response = anti_aliasing_filter.modified_response((start + slope * n) * RATE, slope * RATE**2)
    found = model_with(anti_aliasing_filter).template(np.array([start]), np.array([slope]))
    np.testing.assert_allclose(found[0], chirp * response, atol=1e-12)


@pytest.mark.parametrize("anti_aliasing_filter", FILTERS, ids=lambda f: f.kind)
def test_derivatives_equal_finite_differences(anti_aliasing_filter):
    model = model_with(anti_aliasing_filter)
    start, slope, reference = 0.8, -0.0125, 60.0
    template, derivatives = model.template_jet(start, slope, reference)

    def moved(frequency_step, slope_step):
        """Template with its phase standing still at the reference sample."""
        new_start = start + frequency_step - slope_step * reference
        new_slope = slope + slope_step
        shape = model.template(np.array([new_start]), np.array([new_slope]))[0]
        turns = new_start * reference + new_slope * reference**2 / 2
        turns -= start * reference + slope * reference**2 / 2
        return shape * np.exp(-2j * np.pi * turns)

    np.testing.assert_allclose(template, moved(0.0, 0.0), atol=1e-12)
    for row, (df, ds) in enumerate([(1e-6, 0.0), (0.0, 1e-8)]):
        difference = (moved(df, ds) - moved(-df, -ds)) / (2 * (df + ds))
        scale = np.max(np.abs(difference))
        # Third derivative: (2 pi 64)^3 df^2/6 ~ 1e-5 of the first by frequency, less by slope.
        np.testing.assert_allclose(derivatives[row] / scale, difference / scale, atol=1e-5)


def test_frame_is_returned_read_only_and_checked():
    model = model_with(FILTERS[0])
    frame = np.ones((2, 128))
    checked = model.check(frame)
    assert not checked.flags.writeable
    assert model.check(checked) is checked  # nobody changes it any more
    columns = np.asfortranarray(frame + 1j)
    columns.flags.writeable = False
    assert model.check(columns).flags.c_contiguous
    frame[0, 0] = np.nan
    with pytest.raises(InputError, match="1 samples that are NaN"):
        model.check(frame)
    with pytest.raises(InputError, match=r"shape \(3, 128\); it must be \(2, 128\)"):
        model.check(np.ones((3, 128)))
    with pytest.raises(InputError, match="zero everywhere"):
        model.check(np.zeros((2, 128)))
    with pytest.raises(InputError, match="largest magnitude"):
        model.check(np.full((2, 128), 1e150))


@pytest.mark.parametrize("change", [{"num_samples": 4}, {"num_ramps": 0}, {"sample_rate_hz": 0.0}])
def test_impossible_sizes_are_refused(change):
    settings = {"num_ramps": 2, "num_samples": 128, "sample_rate_hz": RATE} | change
    with pytest.raises(InputError, match=next(iter(change))):
        SignalModel(anti_aliasing_filter=NoFilter(), **settings)
