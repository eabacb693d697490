"""The estimator against the algorithms as printed: two programs, one result."""

import numpy as np
import pytest

from vsep.inference.core.progress import EventKind, Termination
from vsep.inference.core.run import run
from vsep.inference.core.schedule import ROBUST
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import simulate_preset
from vsep.reference import ReferenceSeparator, update_objects
from vsep.reference_costs import Dictionary, channel_atoms, moments, refine_chirp
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
    return model, received + noise / np.sqrt(2.0)


# What the schedule "paper" does in place of the letter.
DEVIATIONS = {"stale_interference": True, "objects_jointly": True}


def several_ramps():
    model, received = frame()
    return model, model.check(received)


def simulation(name, snr_db):
    scenario, observation = simulate_preset(name, snr_db=snr_db, sir_db=-20.0, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    return model, model.check(observation.received)


FRAMES = {"six ramps": several_ramps, "Simulation I": lambda: simulation("simulation-1", 30.0)}


def changed(events):
    return sorted((event.kind.name, event.ramp) for event in events)


@pytest.mark.parametrize("name", FRAMES)
def test_every_step_of_the_paper_schedule_is_the_letter_with_two_deviations(name):
    model, received = FRAMES[name]()
    fast = FactorisedSeparator(model=model, schedule="paper", object_threshold_db=9.0)
    reference = ReferenceSeparator(model=model, **DEVIATIONS)
    energy = np.linalg.norm(received)
    state = fast.init(received)
    for _ in range(12):
        new, info = fast.step(received, state)
        expected, expected_info = reference.step(received, state)
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


@pytest.mark.parametrize("deviation", DEVIATIONS)
def test_without_either_deviation_the_letter_goes_elsewhere(deviation):
    model, received = several_ramps()
    fast = FactorisedSeparator(model=model, schedule="paper", object_threshold_db=9.0)
    options = {name: name != deviation for name in DEVIATIONS}
    reference = ReferenceSeparator(model=model, **options)
    differences = []
    state = fast.init(received)
    for _ in range(6):
        new, _ = fast.step(received, state)
        expected, _ = reference.step(received, state)
        differences.append(abs(new.noise_precision / expected.noise_precision - 1.0))
        state = new
    assert max(differences) > 1e-7  # the steps above agree to 1e-9


def test_the_letter_does_not_settle_where_its_last_theta_comes_after_the_weights():
    model, received = several_ramps()
    settings = {"model": model, "threshold_db": 12.0, "max_iterations": 30}  # no false alarm
    letter = run(ReferenceSeparator(**settings), received)
    assert letter.termination is Termination.MAX_ITERATIONS
    settled = run(ReferenceSeparator(**settings, **DEVIATIONS), received)
    assert settled.termination is Termination.CONVERGED
    assert settled.objects.num_components == letter.objects.num_components == 2


@pytest.mark.scenario
def test_the_robust_schedule_ends_where_the_reference_stands_still():
    model, received = several_ramps()
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
