"""Every registered mitigation method on frames that leave it little, or nothing, to work with."""

import pickle

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.inference.core.progress import Termination
from vsep.mitigation.method import iterate_mitigation, mitigate
from vsep.mitigation.registry import MITIGATIONS, make_mitigation

SHAPE = (6, 24)
METHODS = pytest.mark.parametrize("name", MITIGATIONS)
# All but that which takes the frame apart without being told of any sample.
TOLD = pytest.mark.parametrize("name", [name for name in MITIGATIONS if name != "mca-unmasked"])


def frame(seed=1):
    """One object 20 dB over noise."""
    rng = np.random.default_rng(seed)
    ramp, sample = np.mgrid[: SHAPE[0], : SHAPE[1]]
    noise = rng.normal(size=(2, *SHAPE)) / np.sqrt(2)
    return 10.0 * np.exp(-2j * np.pi * (0.17 * sample + 0.1 * ramp)) + noise[0] + 1j * noise[1]


def lost(share, seed=2):
    return np.random.default_rng(seed).random(SHAPE) < share


def whole_ramps(*ramps):
    mask = np.zeros(SHAPE, dtype=bool)
    mask[list(ramps)] = True
    return mask


CASES = {
    "a few samples": lost(0.1),
    "a whole ramp": whole_ramps(2),
    "70 % lost": lost(0.7),
    "all ramps but one": whole_ramps(0, 1, 2, 3, 5),
    "one clean sample": ~(np.arange(SHAPE[0] * SHAPE[1]).reshape(SHAPE) == 40),
}


def cleaned(name, received, mask):
    return mitigate(make_mitigation(name), received, mask).cleaned


@METHODS
@pytest.mark.parametrize("case", CASES)
def test_whatever_is_lost_the_cleaned_frame_is_finite(name, case):
    mask = CASES[case]
    result = cleaned(name, np.where(mask, 300.0, frame()), mask)
    assert result.shape == SHAPE
    assert np.isfinite(result).all()


@METHODS
def test_zero_in_gives_zero_out(name):
    assert not cleaned(name, np.zeros(SHAPE, dtype=complex), lost(0.2)).any()


@TOLD
def test_a_frame_without_flagged_samples_stays_as_it_is(name):
    np.testing.assert_array_equal(cleaned(name, frame(), np.zeros(SHAPE, dtype=bool)), frame())


@TOLD
def test_a_frame_without_a_clean_sample_is_refused_in_a_sentence(name):
    with pytest.raises(InputError, match="All 144 samples are flagged"):
        cleaned(name, frame(), np.ones(SHAPE, dtype=bool))


@TOLD
def test_what_flagged_samples_hold_plays_no_part_where_the_method_does_not_use_it(name):
    if name in {"noise-canceller", "mca", "mca-2d"}:  # these take the burst itself apart
        return
    mask = lost(0.2)
    quiet, loud = (cleaned(name, np.where(mask, value, frame()), mask) for value in (0.0, 1e6))
    np.testing.assert_array_equal(quiet, loud)


@METHODS
def test_single_precision_stays_single_and_agrees(name):
    received = np.where(lost(0.2), 30.0, frame())
    single = cleaned(name, received.astype(np.complex64), lost(0.2))
    assert single.dtype == np.complex64
    double = cleaned(name, received.astype(np.complex64).astype(np.complex128), lost(0.2))
    # Single precision has a relative spacing of 1.2e-7; dozens of operations per sample follow.
    assert np.linalg.norm(single - double) <= 2e-5 * np.linalg.norm(double)


@METHODS
def test_the_scale_of_a_frame_does_not_matter(name):
    received, mask = np.where(lost(0.2), 30.0, frame()), lost(0.2)
    # A power of two changes exponents only: not a bit of a mantissa may differ.
    scaled = cleaned(name, 2.0**-30 * received, mask)
    np.testing.assert_array_equal(2.0**30 * scaled, cleaned(name, received, mask))


@METHODS
def test_a_paused_run_goes_on_as_if_it_had_not_been(name):
    method, received, mask = make_mitigation(name), frame(), lost(0.2)
    states = list(iterate_mitigation(method, received, mask))
    paused = pickle.loads(pickle.dumps(states[len(states) // 2]))
    resumed = [*iterate_mitigation(method, received, mask, paused)] or [paused]
    np.testing.assert_array_equal(resumed[-1].cleaned, states[-1].cleaned)
    assert [state.iteration for state in states] == list(range(1, len(states) + 1))
    assert method.terminate(states[-1]) is not Termination.RUNNING


@METHODS
def test_a_single_ramp_and_a_single_sample_are_frames_too(name):
    for shape in ((1, 24), (6, 1)):
        received = frame().ravel()[: shape[0] * shape[1]].reshape(shape)
        mask = np.zeros(shape, dtype=bool)
        mask.ravel()[2] = True
        assert np.isfinite(cleaned(name, received, mask)).all()


@METHODS
def test_every_method_bears_its_name_and_can_be_sent_to_another_process(name):
    method = make_mitigation(name)
    assert pickle.loads(pickle.dumps(method)).name == name


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="'magic'; it must be one of zeroing, blanking"):
        make_mitigation("magic")
