import numpy as np
import pytest

from vsep.errors import InputError
from vsep.mitigation.cfar import Cfar, ordered_factor


def noise(*shape):
    return np.random.default_rng(6).exponential(size=shape)


@pytest.mark.parametrize("statistic", ["cell-averaging", "ordered-statistic"])
@pytest.mark.parametrize("shape", [(40_000,), (200, 200)])
def test_noise_is_detected_at_the_rate_asked_for(statistic, shape):
    axes = len(shape)
    detector = Cfar(
        false_alarm_rate=0.01, guard=(1,) * axes, training=(3,) * axes, statistic=statistic
    )
    # 400 expected of 40000. Neighbours share training cells, which widens the binomial deviation
    # of 20; 100 is five of those.
    assert detector.detect(noise(*shape)).sum() == pytest.approx(400, abs=100)


def test_averaging_compares_with_the_mean_of_the_training_cells_around():
    power = noise(24)
    detector = Cfar(false_alarm_rate=0.2, guard=(1,), training=(2,))
    factor = 4 * (0.2 ** (-1 / 4) - 1)
    expected = [
        power[cell] > factor * np.mean([power[(cell + k) % 24] for k in (-3, -2, 2, 3)])
        for cell in range(24)
    ]
    np.testing.assert_array_equal(detector.detect(power), expected)
    assert 0 < sum(expected) < 24


def test_ordered_statistics_see_two_objects_that_mask_each_other_in_an_average():
    power = np.ones((33, 33))
    power[16, 16] = power[16, 20] = 60.0
    settings = {"false_alarm_rate": 1e-4, "guard": (1, 1), "training": (3, 3)}
    averaging, ordered = (
        Cfar(statistic=statistic, **settings).detect(power)
        for statistic in ("cell-averaging", "ordered-statistic")
    )
    assert ordered[16, 16]
    assert ordered[16, 20]
    assert ordered.sum() == 2
    power[16, 18] = 400.0  # a third one between them
    assert not Cfar(statistic="cell-averaging", **settings).detect(power)[16, 16]
    assert Cfar(statistic="ordered-statistic", **settings).detect(power)[16, 16]
    assert averaging.sum() <= 2


def test_ordered_factor_is_that_of_the_product_formula():
    factor = ordered_factor(1e-4, 24, 18)
    product = np.prod([(24 - i) / (24 - i + factor) for i in range(18)])
    assert product == pytest.approx(1e-4, rel=1e-9)


def test_peaks_are_the_highest_of_their_neighbours_and_wrap_around():
    power = np.ones((16, 32))
    power[0, 0], power[0, 31], power[8, 9] = 900.0, 500.0, 300.0
    peaks = Cfar(guard=(1, 2), training=(2, 4)).peaks(power)
    np.testing.assert_array_equal(peaks, [[0, 0], [8, 9]])


def test_an_axis_of_length_one_has_no_training_cells():
    power = np.ones((1, 64))
    power[0, 5] = 1e4
    assert np.argwhere(Cfar().detect(power)).tolist() == [[0, 5]]


def test_an_empty_spectrum_holds_nothing():
    assert not Cfar().detect(np.zeros((32, 64))).any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"false_alarm_rate": 0.0}, "false_alarm_rate is 0"),
        ({"statistic": "smallest"}, "statistic is 'smallest'"),
        ({"guard": (1,)}, r"guard is \(1,\)"),
        ({"training": (-1, 2)}, "at least 0"),
        ({"rank_share": 1.5}, "rank_share is 1.5"),
    ],
)
def test_absurd_settings_are_refused(settings, message):
    with pytest.raises(InputError, match=message):
        Cfar(**settings)


def test_spectra_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="need at least"):
        Cfar().detect(np.ones((8, 64)))
    with pytest.raises(InputError, match="has 1 axes"):
        Cfar().detect(np.ones(64))
    with pytest.raises(InputError, match="no training cell"):
        Cfar(guard=(1, 1), training=(0, 0)).detect(np.ones((8, 8)))
