"""The settling transient: found where it is, and nowhere else; what stands still survives it."""

import numpy as np
import pytest

from vsep.inference.core.run import run
from vsep.inference.core.settling import initial_errors
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

SHAPE = NUM_RAMPS, NUM_SAMPLES = 32, 128
MODEL = SignalModel(
    num_ramps=NUM_RAMPS,
    num_samples=NUM_SAMPLES,
    sample_rate_hz=10e6,
    anti_aliasing_filter=NoFilter(),
)
LINES = np.array([[20.3, 0.0], [47.6, 0.0], [30.2, 7.4]])  # cells; two of them stand still


def noise(seed):
    draws = np.random.default_rng(seed).standard_normal((2, *SHAPE))
    return (draws[0] + 1j * draws[1]) / np.sqrt(2.0)


def lines(snr_db=30.0):
    n, p = np.arange(NUM_SAMPLES), np.arange(NUM_RAMPS)[:, None]
    size = np.sqrt(10.0 ** (snr_db / 10.0) / (NUM_RAMPS * NUM_SAMPLES))
    return size * sum(
        np.exp(-2j * np.pi * (beat * n / NUM_SAMPLES + doppler * p / NUM_RAMPS))
        for beat, doppler in LINES
    )


def transient():
    n = np.arange(NUM_SAMPLES)
    return 60.0 * np.exp(-n / 4.0 + 0.8j * n) + 20.0 * np.exp(-n / 7.0)


def found_cells(state):
    cells = np.stack(
        [state.objects.beats * NUM_SAMPLES, state.objects.dopplers * NUM_RAMPS], axis=1
    )
    return cells[np.argsort(cells[:, 0])]


@pytest.mark.parametrize("seed", range(5))
def test_noise_and_objects_at_rest_are_no_transient(seed):
    assert initial_errors(noise(seed), MODEL, None) is None
    assert initial_errors(noise(seed) + lines(50.0), MODEL, None) is None


@pytest.mark.parametrize("seed", range(3))
def test_objects_that_stand_still_survive_the_transient(seed):
    frame = noise(seed) + lines() + transient()
    state = run(ObjectOnlySeparator(model=MODEL), frame).state
    expected = LINES[np.argsort(LINES[:, 0])]
    # 30 dB: one deviation is sqrt(6) / (2 pi) / 31.6 = 0.012 cells
    np.testing.assert_allclose(found_cells(state), expected, rtol=0, atol=0.06)
    error = state.receiver.transients[0] - transient()
    # A mean over the ramps has this noise; 0.12 of the two resting objects lie where it is.
    assert np.sqrt(np.mean(np.abs(error) ** 2)) < 2.0 / np.sqrt(NUM_RAMPS)


def test_without_the_transient_estimates_are_those_of_a_frame_that_has_none():
    plain = run(ObjectOnlySeparator(model=MODEL), noise(4) + lines()).state
    settled = run(ObjectOnlySeparator(model=MODEL), noise(4) + lines() + transient()).state
    deviation = np.sqrt(6.0) / (2.0 * np.pi) / 10.0**1.5
    np.testing.assert_allclose(
        found_cells(settled), found_cells(plain), rtol=0, atol=2.0 * deviation
    )
    assert plain.receiver is None


def test_the_papers_schedule_knows_no_transient():
    frame = noise(1) + lines() + transient()
    paper = FactorisedSeparator(model=MODEL, schedule="paper", object_threshold_db=9.0)
    assert paper.init(frame).receiver is None
    assert FactorisedSeparator(model=MODEL).init(frame).receiver is not None
