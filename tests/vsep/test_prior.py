"""The prior model: from peaks of past frames to lower thresholds."""

import numpy as np
import pytest

from tests.vsep.sparse_bench import gap_scene
from vsep.errors import InputError
from vsep.mitigation.method import mitigate
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame
from vsep.mitigation.sparse.thresholding import pm_iht, pm_ist

SHAPE = (16, 32)


def seen(magnitude, *peaks):
    flags = np.zeros(SHAPE, dtype=bool)
    for peak in peaks:
        flags[peak] = True
    return SeenFrame(magnitude=np.full(SHAPE, magnitude), peaks=flags)


def tone(beat, doppler, level=1.0):
    ramp, sample = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return level * np.exp(-2j * np.pi * (beat * sample + doppler * ramp))


def test_peaks_of_a_frame_are_where_its_objects_are():
    rng = np.random.default_rng(0)
    noise = 0.01 * (rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE))
    history = PriorModel().see((), tone(5 / 32, 3 / 16) + noise)
    np.testing.assert_array_equal(np.argwhere(history[0].peaks), [[3, 5]])


def test_only_the_last_frames_count():
    prior = PriorModel(num_frames=2)
    history = ()
    for beat in (1 / 32, 9 / 32, 20 / 32):
        history = prior.see(history, tone(beat, 0.0))
    assert [int(np.argwhere(frame.peaks)[0, 1]) for frame in history] == [9, 20]


def test_probability_is_the_likelihood_relative_to_its_peak():
    # Peaks of 4 and 2 in one cell: mean 3, deviation 1; the last magnitude there is 2.
    history = (seen(4.0, (3, 5)), seen(2.0, (3, 5)))
    relief = PriorModel(reach=(0, 0), divisor=1.0).relief(history)
    assert relief[3, 5] == pytest.approx(np.exp(-0.5), rel=1e-12)
    assert np.count_nonzero(relief) == 1


def test_a_cell_seen_once_has_a_quarter_of_its_mean_as_deviation():
    # Mean 4 from one peak, deviation 1; the last magnitude is 3.
    history = (seen(4.0, (3, 5)), seen(3.0))
    relief = PriorModel(reach=(0, 0), divisor=1.0).relief(history)
    assert relief[3, 5] == pytest.approx(np.exp(-0.5), rel=1e-12)


def test_the_density_has_the_inverse_unit_of_the_spectrum():
    prior = PriorModel(reading="density", reach=(0, 0), divisor=100.0)
    reliefs = [prior.relief((seen(level, (3, 5)),))[3, 5] for level in (1.0, 10.0)]
    assert reliefs[0] == pytest.approx(1.0 / (np.sqrt(2.0 * np.pi) * 0.25) / 100.0, rel=1e-12)
    assert reliefs[1] == pytest.approx(reliefs[0] / 10.0, rel=1e-12)


def test_the_likelihood_has_no_unit():
    frame = gap_scene(0, share=0.1, snr_db=20.0).objects
    prior = PriorModel()
    reliefs = [prior.relief(prior.see((), factor * frame)) for factor in (1.0, 1e-6j)]
    np.testing.assert_allclose(reliefs[1], reliefs[0], rtol=1e-9)
    assert reliefs[0].max() > 0.7


def test_the_window_spreads_peaks_with_unit_height_and_wraps_around():
    relief = PriorModel(reach=(1, 2), divisor=1.0, largest=1.0).relief((seen(1.0, (0, 31)),))
    rows = np.sin(np.pi * np.arange(1, 4) / 4.0) ** 2
    columns = np.sin(np.pi * np.arange(1, 6) / 6.0) ** 2
    block = np.roll(relief, (1, 3), axis=(0, 1))[:3, :5]
    np.testing.assert_allclose(block, np.outer(rows, columns), atol=1e-12)
    assert np.count_nonzero(relief) == 15


def test_zeta_is_the_clipped_line():
    history = (seen(1.0, (3, 5)),)
    options = {"reach": (0, 0), "gain": 0.5, "offset": 0.1, "divisor": 2.0}
    relief = PriorModel(**options).relief(history)
    assert relief[3, 5] == pytest.approx(0.3)
    assert relief[0, 0] == pytest.approx(0.05)
    assert PriorModel(largest=0.2, **options).relief(history)[3, 5] == 0.2


@pytest.mark.parametrize("make", [pm_ist, pm_iht])
def test_a_prior_of_zero_is_bit_for_bit_no_prior(make):
    scene = gap_scene(0, share=0.3, snr_db=10.0)
    quiet = SeenFrame(
        magnitude=np.ones(scene.mask.shape), peaks=np.zeros(scene.mask.shape, dtype=bool)
    )
    plain, without = (
        mitigate(make(history=history), scene.received, scene.mask) for history in ((), (quiet,))
    )
    assert without.iteration == plain.iteration
    np.testing.assert_array_equal(without.cleaned, plain.cleaned)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"num_frames": 0}, "num_frames is 0"),
        ({"largest": 1.5}, "largest is 1.5"),
        ({"reach": (2, -1)}, "smallest reach is -1"),
        ({"reading": "guess"}, "reading is 'guess'; it must be likelihood or density"),
        ({"divisor": 0.0}, "divisor is 0"),
    ],
)
def test_unusable_settings_are_refused(setting, message):
    with pytest.raises(InputError, match=message):
        PriorModel(**setting)


def test_a_frame_too_small_for_the_detector_says_nothing():
    history = PriorModel().see((), tone(5 / 32, 3 / 16))
    assert PriorModel().see(history, np.ones((4, 32))) is history
