"""The correction of the filter: dense truth, zero where it is right, and what it is for."""

import pickle
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from vsep.inference.bursts.filter_correction import (
    MAX_DEVIATION,
    SplineModel,
    passive_spline_ratios,
    spline_columns,
    update_correction,
)
from vsep.inference.bursts.search import BurstSearch
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.run import iterate, run
from vsep.inference.core.schedule import ROBUST
from vsep.inference.core.state import FilterCorrection
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import preset, simulate_preset
from vsep.signal.corrected_filter import NUM_SPLINES
from vsep.signal.filters import ButterworthFilter, NoFilter, RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.units import from_db

RATE, NUM_SAMPLES, SLOPE, NOISE_PRECISION = 5.1e6, 128, -0.011065, 100.0
ASSUMED = RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25)
MODEL = SignalModel(
    num_ramps=2, num_samples=NUM_SAMPLES, sample_rate_hz=RATE, anti_aliasing_filter=ASSUMED
)


def frame(true_filter, weight=60.0):
    """One burst in each ramp, through the true filter, and noise."""
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(MODEL.shape) + 1j * rng.standard_normal(MODEL.shape)
    centres = np.array([50.0, 75.0])
    model = replace(MODEL, anti_aliasing_filter=true_filter)
    bursts = model.template(-SLOPE * centres, np.full(2, SLOPE)) * weight / np.sqrt(NUM_SAMPLES)
    return noise / np.sqrt(2 * NOISE_PRECISION) + bursts


def workspace(received, model=MODEL, updates=3):
    """Bursts found and their channels estimated, without a correction."""
    work = InterferenceWorkspace(
        model, ROBUST, float(from_db(ROBUST.interference_threshold_db)), ()
    )
    BurstSearch(work, received, NOISE_PRECISION, weakest_share=0.01).run()
    for _ in range(updates):
        work.update(received, NOISE_PRECISION)
    return work


def some_correction(seed=1):
    rng = np.random.default_rng(seed)
    active = np.arange(10, 22)
    values = 0.05 * (rng.standard_normal(12) + 1j * rng.standard_normal(12))
    return FilterCorrection(
        active_splines=active,
        amplitudes=values,
        covariance=np.eye(12, dtype=complex) * 1e-4,
        precisions=np.full(12, 100.0),
        trace=0.0,
    )


def test_columns_are_the_derivatives_of_the_bursts():
    received = frame(ASSUMED)
    work = workspace(received)
    ramp = work.ramps[1]
    (columns,) = spline_columns([ramp], work.grid, MODEL)
    before = np.sum(ramp.signals, axis=0)
    correction = some_correction()
    work.correct(correction)
    work.synthesize()
    change = work.signal[1] - before
    # Linear in the coefficients: no error but rounding, amplified 1e5 times by the cubics.
    expected = columns @ correction.coefficients
    np.testing.assert_allclose(change, expected, rtol=0, atol=1e-9 * np.abs(before).max())


def test_moments_are_those_of_the_dense_marginal_model():
    received = frame(ButterworthFilter(cutoff_hz=RATE / 4, order=4))
    work = workspace(received)
    work.correct(some_correction())
    work.recompute(received, NOISE_PRECISION)
    gram, projections = SplineModel(work, received, NOISE_PRECISION).moments()
    expected_gram = np.zeros((NUM_SPLINES, NUM_SPLINES), dtype=complex)
    expected = np.zeros(NUM_SPLINES, dtype=complex)
    for p, ramp in work.ramps.items():
        atoms = work.grid.atoms(ramp.bins).T
        (columns,) = spline_columns([ramp], work.grid, MODEL)
        channels = ramp.templates[ramp.owners].T * atoms
        spread = np.eye(NUM_SAMPLES) + NOISE_PRECISION * (
            channels @ np.diag(1.0 / ramp.precisions) @ channels.conj().T
        )
        weighted = np.linalg.solve(spread, columns).conj().T
        expected_gram += weighted @ columns
        expected += weighted @ (received[p] + columns @ work.correction.coefficients)
    # Channel columns are explained to 1e-6 and less of their energy: as many digits are lost.
    scale = np.abs(np.diagonal(expected_gram)).max()
    np.testing.assert_allclose(gram, expected_gram, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(projections, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def test_ratios_of_the_first_spline_are_those_of_the_moments():
    received = frame(ButterworthFilter(cutoff_hz=RATE / 4, order=4))
    work = workspace(received)
    gram, projections = SplineModel(work, received, NOISE_PRECISION).moments()
    energy = np.diagonal(gram).real
    seen = energy > 1e-6 * energy.max()
    expected = NOISE_PRECISION * np.abs(projections[seen]) ** 2 / energy[seen]
    # Channels explain all but 1e-6 of some columns: as many of 16 digits are lost.
    ratios = passive_spline_ratios(work, received, NOISE_PRECISION)
    np.testing.assert_allclose(ratios[seen], expected, rtol=1e-7)


def test_the_right_filter_is_left_alone():
    received = frame(ASSUMED)
    work = workspace(received)
    signal = work.signal
    update_correction(work, received, NOISE_PRECISION)
    assert work.correction.num_splines == 0
    assert work.model is work.assumed
    np.testing.assert_array_equal(work.signal, signal)


def test_a_wrong_filter_is_corrected_down_to_the_noise():
    received = frame(ButterworthFilter(cutoff_hz=RATE / 4, order=4), weight=600.0)
    levels = []
    for corrected in (False, True):
        work = workspace(received, updates=1)
        for _ in range(8):
            work.update(received, NOISE_PRECISION)
            if corrected:
                update_correction(work, received, NOISE_PRECISION)
        levels.append(np.mean(np.abs(received - work.signal) ** 2) * NOISE_PRECISION)
    # Bursts 40 dB above the noise: measured 1.3 and 59, where noise alone leaves one at most.
    assert levels[1] < 1.5
    assert levels[0] > 10.0 * levels[1]


def test_without_a_filter_there_is_nothing_to_correct():
    received = frame(ASSUMED)
    work = workspace(received, replace(MODEL, anti_aliasing_filter=NoFilter()), updates=1)
    update_correction(work, received, NOISE_PRECISION)
    assert work.correction.num_splines == 0


def mismatched(order, sir_db, seed):
    """Simulation I through a Butterworth filter; the true beat, the frame and the estimator."""
    drawn = preset("simulation-1", snr_db=30.0, sir_db=sir_db, rng=np.random.default_rng(0))
    assumed = drawn.anti_aliasing_filter
    scenario, observation = simulate_preset(
        "simulation-1",
        snr_db=30.0,
        sir_db=sir_db,
        seed=seed,
        anti_aliasing_filter=ButterworthFilter(cutoff_hz=assumed.cutoff_hz, order=order),
        interference_model="convolution",
    )
    model = SignalModel.of_radar(scenario.radar, assumed)
    separator = FactorisedSeparator(model=model, object_threshold_db=9.0)
    return observation.truth.beats[0], observation.received, separator


def splines_after(num_steps, separator, received):
    """Splines that are active after so many iterations."""
    return [
        step.state.filter_correction.num_splines
        for step in islice(iterate(separator, received), num_steps)
    ][-1]


@pytest.mark.parametrize("order", [4, 8])
def test_a_wrong_filter_is_told_before_its_errors_become_objects(order):
    _, received, separator = mismatched(order, -40.0, 2)
    assert splines_after(3, separator, received) > 0


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-b"])
def test_the_right_filter_is_not_doubted_while_channels_are_incomplete(name):
    scenario, observation = simulate_preset(name, snr_db=60.0, sir_db=-40.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    assert splines_after(5, FactorisedSeparator(model=model), observation.received) == 0


def test_paused_and_resumed_run_is_the_same_with_a_correction():
    _, received, separator = mismatched(4, -30.0, 1)
    steps = list(iterate(separator, received))
    seventh = steps[6].state
    assert seventh.filter_correction.num_splines > 0
    resumed = run(separator, received, state=pickle.loads(pickle.dumps(seventh))).state
    whole = steps[-1].state
    assert resumed.iteration == whole.iteration
    np.testing.assert_array_equal(resumed.objects.beats, whole.objects.beats)
    first, second = resumed.filter_correction, whole.filter_correction
    np.testing.assert_array_equal(first.amplitudes, second.amplitudes)
    np.testing.assert_array_equal(resumed.interference_signal, whole.interference_signal)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("order", "sir_db"), [(8, -40.0), pytest.param(4, -30.0, marks=pytest.mark.slow)]
)
def test_objects_are_found_through_a_wrong_filter(order, sir_db):
    false_alarms, largest = [], []
    for seed in range(2, 7):
        beat, received, separator = mismatched(order, sir_db, seed)
        state = run(separator, received).state
        near = np.abs(state.objects.beats - beat) < 0.5 / 256
        assert np.any(near)
        assert state.filter_correction.num_splines > 0
        false_alarms.append(np.sum(~near))
        largest.append(np.abs(state.filter_correction.amplitudes).max())
    # 0.2 are expected of noise alone at 9 dB: more than 5 in 5 frames have a chance of 0.06 %.
    assert np.sum(false_alarms) <= 5
    # The prior holds the spline within a few of its deviations, whatever the fit gains.
    assert max(largest) < 8 * MAX_DEVIATION
