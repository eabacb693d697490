"""Channels, scenes and the truth of a frame."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.scene import Channel, GroundTruth, Scene


def channel():
    return Channel(
        delays_s=np.array([1e-8, 2e-8]), dopplers_hz=np.zeros(2), weights=np.array([1.0, 1j])
    )


def truth(interference):
    return GroundTruth(
        beats=np.zeros(0),
        dopplers=np.zeros(0),
        amplitudes=np.zeros(0, dtype=complex),
        object_signal=np.zeros_like(interference),
        interference_signal=interference,
        bursts=(),
        noise_precision=1.0,
    )


def test_channel_keeps_copies_that_cannot_be_written():
    delays = np.array([1e-8, 2e-8])
    kept = Channel(delays_s=delays, dopplers_hz=[0, 0], weights=np.ones(2))
    delays[0] = 7.0
    assert kept.delays_s[0] == 1e-8
    assert kept.num_paths == 2
    assert kept.dopplers_hz.dtype == np.float64
    assert kept.weights.dtype == np.complex128
    for array in (kept.delays_s, kept.dopplers_hz, kept.weights):
        assert not array.flags.writeable


def test_channel_survives_pickling():
    copy = pickle.loads(pickle.dumps(channel()))
    np.testing.assert_array_equal(copy.weights, [1.0, 1j])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"delays_s": np.zeros(3)}, r"shapes \[\(3,\), \(2,\), \(2,\)\]"),
        ({name: np.zeros((1, 2)) for name in ("delays_s", "dopplers_hz", "weights")}, r"\(L,\)"),
        ({"weights": np.array([1.0, np.nan])}, "NaN or infinity"),
        ({"dopplers_hz": np.array([1.0, np.inf])}, "NaN or infinity"),
    ],
)
def test_unusable_channels_are_refused(values, message):
    good = {"delays_s": np.zeros(2), "dopplers_hz": np.zeros(2), "weights": np.ones(2)}
    with pytest.raises(InputError, match=message):
        Channel(**good | values)


@pytest.mark.parametrize(
    ("levels", "message"),
    [
        ({"snr_db": 201.0}, "SNR is 201 dB; it must lie between -100 and 200 dB"),
        ({"snr_db": float("nan")}, "SNR is nan"),
        ({"snr_db": 0.0, "sir_db": -201.0}, "SIR is -201 dB"),
    ],
)
def test_absurd_levels_are_refused(levels, message):
    with pytest.raises(InputError, match=message):
        Scene(objects=channel(), **levels)


def test_interfered_samples_exceed_a_share_of_the_peak_power():
    interference = np.array([[10.0, 0.4, 0.3], [0.0, 0.0, -1j]])
    mask = truth(interference).interfered_samples()
    # A thousandth of 100 is 0.1: magnitudes over 0.316.
    np.testing.assert_array_equal(mask, [[True, True, False], [False, False, True]])
    strict = truth(interference).interfered_samples(relative_level=0.5)
    np.testing.assert_array_equal(strict, [[True, False, False], [False, False, False]])


def test_frame_without_interference_has_no_interfered_samples():
    assert not truth(np.zeros((2, 3), dtype=complex)).interfered_samples().any()


def test_perfect_mask_holds_what_exceeds_the_noise():
    interference = np.array([[10.0, 1.5, 1.4], [0.0, 0.0, -1.5j]])
    known = replace(truth(interference), noise_precision=0.5)  # a noise power of 2
    np.testing.assert_array_equal(known.perfect_mask(), [[True, True, False], [False, False, True]])
    np.testing.assert_array_equal(known.perfect_mask(share_of_noise=2.0), np.abs(interference) > 2)


def test_perfect_mask_of_a_real_frame_lies_under_the_peak():
    interference = np.array([[10.0, 0.4, 0.3]])
    real = replace(truth(interference), noise_precision=float("nan"))
    np.testing.assert_array_equal(real.perfect_mask(), [[True, True, False]])
