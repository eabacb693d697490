"""The estimator against the algorithms as printed: two programs, one result."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from vsep.inference.core.progress import EventKind, Termination
from vsep.inference.core.run import iterate, run
from vsep.inference.core.schedule import PAPER, ROBUST
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.refinement import joint_step, place_components
from vsep.presets.scenes import simulate_preset
from vsep.reference import ReferenceSeparator, update_objects
from vsep.reference_costs import (
    Dictionary,
    channel_atoms,
    moments,
    object_atoms,
    refine_chirp,
    refine_jointly,
)
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.units import from_db

RATE = 5.1e6
SHAPE = (6, 64)


def frame():
    """Two objects, one of them under the others' bursts, bursts in two ramps, unit noise."""
    model = SignalModel(
        num_ramps=SHAPE[0],
        num_samples=SHAPE[1],
        sample_rate_hz=RATE,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    )
    rng = np.random.default_rng(3)
    factors = line_factors(np.array([0.1, 0.31]), SHAPE[1]), line_factors(np.array([0.2, -0.1]), 6)
    received = synthesize(np.array([300.0, 60.0j]), *factors)
    slopes = np.array([0.021, -0.028])
    for p, template in zip(
        (1, 4), model.template(-slopes * np.array([30.2, 40.7]), slopes), strict=True
    ):
        received[p] += 200.0 * template * (1.0 + 0.3 * np.exp(-2j * np.pi * 0.05 * np.arange(64)))
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    return model, model.check(received + noise / np.sqrt(2.0))


def small_frame(seed):
    """Two objects and a burst in one or two of three ramps, anywhere, in unit noise."""
    rng = np.random.default_rng(seed)
    shape = 3, 48
    model = SignalModel(
        num_ramps=shape[0],
        num_samples=shape[1],
        sample_rate_hz=RATE,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    )
    factors = (
        line_factors(rng.uniform(-0.2, 0.2, 2), 48),
        line_factors(rng.uniform(-0.5, 0.5, 2), 3),
    )
    received = synthesize(np.array([60.0, 20.0j]), *factors)
    interfered = np.arange(1 + seed % 2)
    slopes = rng.choice([-1.0, 1.0], len(interfered)) * rng.uniform(0.02, 0.05, len(interfered))
    level = 10.0 ** rng.uniform(0.0, 1.5)
    received[interfered] += level * model.template(-slopes * rng.uniform(12.0, 36.0), slopes)
    noise = rng.standard_normal((2, *shape)) / np.sqrt(2.0)
    return model, model.check(received + noise[0] + 1j * noise[1])


def simulation(name, snr_db):
    scenario, observation = simulate_preset(name, snr_db=snr_db, sir_db=-20.0, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    return model, model.check(observation.received)


FRAMES = {
    "six ramps": frame,
    "Simulation I": lambda: simulation("simulation-1", 30.0),
    **{f"frame {seed}": partial(small_frame, seed) for seed in range(18)},
}


def changed(events):
    return sorted((event.kind.name, event.ramp) for event in events)


def test_the_frames_hold_bursts_and_objects_of_many_levels():
    levels = [np.abs(small_frame(seed)[1]).max() for seed in range(18)]
    assert min(levels) < 12.0
    assert max(levels) > 25.0


@pytest.mark.scenario
@pytest.mark.parametrize("name", FRAMES)
def test_every_step_of_the_paper_schedule_is_the_letter(name):
    model, received = FRAMES[name]()
    fast = FactorisedSeparator(model=model, schedule="paper", object_threshold_db=9.0)
    reference = ReferenceSeparator(model=model)
    energy = np.linalg.norm(received)
    state = fast.init(received)
    for _ in range(20):
        new, info = fast.step(received, state)
        expected, expected_info = reference.step(received, state)
        assert (new.sample_weights, new.noise_spectrum, new.used_share) == (None, None, 1.0)
        events = [event for event in info.events if event.kind is not EventKind.CHIRP_STARTED]
        assert changed(events) == changed(expected_info.events)
        assert new.noise_precision == pytest.approx(expected.noise_precision, rel=1e-9)
        for ours, theirs in zip(new.bursts, expected.bursts, strict=True):
            assert ours.active_bins.tolist() == theirs.active_bins.tolist()
            assert ours.slope == pytest.approx(theirs.slope, rel=1e-9)
            assert ours.centre == pytest.approx(theirs.centre, rel=1e-9, abs=1e-9)
            np.testing.assert_allclose(ours.precisions, theirs.precisions, rtol=1e-6)
        for signal in ("object_signal", "interference_signal"):
            error = np.linalg.norm(getattr(new, signal) - getattr(expected, signal))
            assert error < 1e-9 * energy
        np.testing.assert_allclose(new.objects.beats, expected.objects.beats, atol=1e-9)
        np.testing.assert_allclose(new.objects.dopplers, expected.objects.dopplers, atol=1e-9)
        state = new


def test_the_letter_has_white_noise_and_counts_every_sample_also_in_a_frame_of_many_ramps():
    model, received = simulation("simulation-2-c", 60.0)
    separator = FactorisedSeparator(model=model, schedule="paper", max_iterations=12)
    for step in iterate(separator, received):
        state = step.state
        assert (state.sample_weights, state.noise_spectrum, state.used_share) == (None, None, 1.0)
        assert state.filter_correction.num_splines == 0


def test_the_letter_does_not_settle_where_its_last_theta_comes_after_the_weights():
    model, received = frame()
    settings = {"model": model, "object_threshold_db": 12.0, "max_iterations": 30}
    letter = run(FactorisedSeparator(**settings, schedule="paper"), received)
    assert letter.termination is Termination.MAX_ITERATIONS
    follow = replace(PAPER, recompute_amplitudes=True)
    settled = run(FactorisedSeparator(**settings, schedule=follow), received)
    assert settled.termination is Termination.CONVERGED
    assert settled.objects.num_components == letter.objects.num_components == 2


def test_the_joint_step_of_the_objects_is_that_on_their_common_cost():
    _, received = frame()
    points = np.array([[0.1002, 0.21], [0.1079, 0.15], [0.3096, -0.11]])
    precisions, noise_precision = np.array([1e-4, 1e-3, 3e-3]), 1.1
    none = np.zeros((0, SHAPE[1]), complex), np.zeros((0, SHAPE[0]), complex)
    placed = place_components(points, precisions, received, noise_precision, none)
    dictionary = Dictionary(object_atoms(points, SHAPE), precisions)
    expected = refine_jointly(dictionary, points, received, noise_precision)
    assert np.abs(expected - points).max() > 1e-4
    np.testing.assert_allclose(joint_step(placed, received).points, expected, atol=1e-9)


@pytest.mark.scenario
def test_the_robust_schedule_ends_where_the_reference_stands_still():
    model, received = frame()
    separator = FactorisedSeparator(model=model)
    solution = run(separator, received)
    state, noise_precision = solution.state, solution.state.noise_precision
    assert solution.termination is Termination.CONVERGED
    assert [burst.ramp for burst in state.bursts] == [1, 4]
    assert state.sample_weights is None
    used, num_used = received, received.size
    # Objects: one more round of Algorithm 3 moves none by a hundredth of its deviation.
    threshold = float(from_db(separator.threshold_db))
    objects, events, change = update_objects(
        state.objects, 100, used - state.interference_signal, noise_precision, threshold
    )
    assert events == [EventKind.OBJECT_REJECTED]
    assert change < 0.01
    np.testing.assert_allclose(objects.precisions, state.objects.precisions, rtol=1e-3)
    # Bursts: theta stays, active columns exceed the lower threshold, passive ones not the upper.
    trace = 0.0
    for burst in state.bursts:
        row = (used - state.object_signal)[burst.ramp]
        theta = np.array([burst.start_frequency, burst.slope])
        bins = burst.active_bins.tolist()
        moved = refine_chirp(theta, bins, burst.precisions, row, noise_precision, model)
        assert abs(moved[1] / theta[1] - 1.0) < 1e-5
        assert abs(moved[0] / moved[1] - theta[0] / theta[1]) < 1e-3  # samples of the centre
        columns = model.template(*theta[:, None])[0][:, None] * channel_atoms(model)
        active = Dictionary(columns[:, bins], burst.precisions)
        _, ratios = moments(columns, active, row, noise_precision)
        ratios[bins] = 0.0
        upper = float(from_db(ROBUST.interference_threshold_db))
        assert ratios.max() <= upper
        for index, bin_ in enumerate(bins):
            own = moments(columns[:, [bin_]], active.without(index), row, noise_precision)
            assert own[1][0] > upper / float(from_db(ROBUST.prune_margin_db))
        trace += np.trace(active.atoms @ burst.covariance @ active.atoms.conj().T).real
    # lambda, (65)
    factors = line_factors(objects.beats, SHAPE[1]), line_factors(objects.dopplers, SHAPE[0])
    gram = np.multiply(*(factor.conj() @ factor.T for factor in factors))
    trace += np.trace(gram @ objects.covariance).real
    left = used - state.object_signal - state.interference_signal
    error = float(np.sum(np.abs(left) ** 2)) + trace
    assert noise_precision == pytest.approx(num_used / error, rel=1e-3)
