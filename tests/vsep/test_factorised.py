"""Algorithm 1 as a state machine: pure, resumable, scale-free, and honest about its end."""

import dataclasses
import pickle

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.inference.bursts.sequence import BurstSequence
from vsep.inference.core.progress import EventKind, Termination
from vsep.inference.core.run import iterate, run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.joint import JointSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.scenes import preset, simulate_preset
from vsep.signal.template import SignalModel


def model_of(name):
    scenario = preset(name, snr_db=0.0, sir_db=0.0, rng=np.random.default_rng(0))
    radar = scenario.radar
    return SignalModel.of_radar(radar, scenario.anti_aliasing_filter)


ESTIMATORS = {
    "robust": FactorisedSeparator(model=model_of("simulation-2-c")),
    "paper": FactorisedSeparator(
        model=model_of("simulation-2-c"), schedule="paper", max_iterations=5
    ),
    "joint": JointSeparator(model=model_of("simulation-2-c"), max_iterations=5),
    "object-only": ObjectOnlySeparator(model=model_of("simulation-2-c")),
}


@pytest.fixture(scope="module")
def received():
    _, observation = simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-10.0, seed=4)
    return observation.received


@pytest.fixture(scope="module")
def solution(received):
    return run(ESTIMATORS["robust"], received)


def count_events(events, kind):
    return sum(event.kind is kind for event in events)


def assert_same_record(first, second):
    """Equality to the bit of two frozen records, through all their fields."""
    assert type(first) is type(second)
    if dataclasses.is_dataclass(first):
        for field in dataclasses.fields(first):
            assert_same_record(getattr(first, field.name), getattr(second, field.name))
    elif isinstance(first, (tuple, BurstSequence)):
        assert len(first) == len(second)
        for one, other in zip(first, second, strict=True):
            assert_same_record(one, other)
    elif isinstance(first, np.ndarray):
        assert first.dtype == second.dtype
        assert first.shape == second.shape
        assert first.tobytes() == second.tobytes()
    else:
        assert repr(first) == repr(second)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_step_is_pure_and_leaves_its_inputs_untouched(name, received):
    estimator = ESTIMATORS[name]
    state = estimator.init(received)
    for _ in range(2):
        state, _ = estimator.step(received, state)
    frame, before = received.copy(), pickle.dumps(state)
    first, first_info = estimator.step(received, state)
    second, second_info = estimator.step(received, state)
    assert pickle.dumps(state) == before
    np.testing.assert_array_equal(received, frame)
    assert_same_record(first, second)
    assert_same_record(first_info, second_info)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_paused_and_resumed_run_equals_the_uninterrupted_one_bit_for_bit(name, received):
    estimator = ESTIMATORS[name]
    whole = run(estimator, received)
    steps = iterate(estimator, received)
    second = [next(steps) for _ in range(2)][-1]
    paused = pickle.loads(pickle.dumps(second.state))  # as after a file or another process
    assert_same_record(run(estimator, received, state=paused).state, whole.state)


def test_arrays_of_a_state_are_read_only(solution):
    state = solution.state
    with pytest.raises(ValueError, match="read-only"):
        state.object_signal[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        state.objects.beats[0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        state.iteration = 3


@pytest.mark.parametrize("factor", [1e-6, 1e6, np.exp(1j)])
def test_scale_and_phase_of_the_input_change_no_object(received, solution, factor):
    scaled = run(ESTIMATORS["robust"], received * factor)
    assert scaled.iterations == solution.iterations
    np.testing.assert_allclose(scaled.objects.beats, solution.objects.beats, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        scaled.objects.dopplers, solution.objects.dopplers, rtol=0, atol=1e-9
    )
    expected = solution.objects.amplitudes * factor
    np.testing.assert_allclose(scaled.objects.amplitudes, expected, rtol=1e-6)
    power = abs(factor) ** 2
    assert scaled.state.noise_precision * power == pytest.approx(
        solution.state.noise_precision, rel=1e-6
    )


def test_both_sources_and_the_noise_account_for_the_frame(received, solution):
    state = solution.state
    rest = received - state.object_signal - state.interference_signal
    power = np.mean(np.abs(rest) ** 2)
    # lambda counts the weights' uncertainty on top: about one degree of freedom per component.
    components = state.objects.num_components
    components += sum(burst.num_components for burst in state.bursts)
    assert 1.0 / state.noise_precision == pytest.approx(
        power * (1 + components / received.size), rel=0.02
    )


def test_the_separability_ratio_is_that_of_dense_matrices(received, solution):
    objects = solution.objects
    ramp, sample = np.mgrid[: received.shape[0], : received.shape[1]]
    turns = np.multiply.outer(sample, objects.beats) + np.multiply.outer(ramp, objects.dopplers)
    atoms = np.exp(-2j * np.pi * turns).reshape(received.size, -1) / np.sqrt(received.size)
    own = atoms.conj().T @ (atoms @ objects.amplitudes)
    other = atoms.conj().T @ solution.state.interference_signal.ravel()
    ratio_db = 20.0 * np.log10(np.linalg.norm(own) / np.linalg.norm(other))
    assert solution.infos[-1].separability_ratio_db == pytest.approx(ratio_db, abs=1e-6)


def test_events_tell_the_whole_story_of_the_components(solution):
    events = [event for info in solution.infos for event in info.events]
    added = count_events(events, EventKind.OBJECT_ADDED)
    pruned = count_events(events, EventKind.OBJECT_PRUNED)
    assert added - pruned == solution.objects.num_components
    assert added == solution.state.next_component_id
    ids = {event.component_id for event in events if event.kind is EventKind.OBJECT_ADDED}
    assert set(solution.objects.component_ids) <= ids
    started = count_events(events, EventKind.CHIRP_STARTED)
    dropped = count_events(events, EventKind.CHIRP_DROPPED)
    assert started - dropped == len(solution.state.interfered_ramps)
    for event in events:
        if event.kind in (EventKind.OBJECT_ADDED, EventKind.CHIRP_STARTED):
            assert event.snr_db > event.threshold_db


def test_bursts_are_found_in_the_right_ramps_with_the_right_parameters(solution):
    _, observation = simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-10.0, seed=4)
    bursts = {burst.ramp: burst for burst in observation.truth.bursts}
    assert solution.state.interfered_ramps == tuple(sorted(bursts))
    rate = ESTIMATORS["robust"].model.sample_rate_hz
    for ramp, burst in bursts.items():
        (found,) = solution.state.bursts_in(ramp)
        true_centre = -burst.start_frequency_hz / burst.slope_hz_per_s * rate
        # The slope is known to (1/SNR)^1/2 over the squared time-bandwidth product, but trades
        # with the channel's delays: a tenth of the burst is what the channel can absorb.
        length = 2 * 0.25 / abs(found.slope)
        assert abs(found.centre - true_centre) < 0.1 * length
        assert found.slope * rate**2 == pytest.approx(burst.slope_hz_per_s, rel=0.05)


def test_object_only_never_models_a_burst(received):
    solution = run(ESTIMATORS["object-only"], received)
    assert solution.state.interfered_ramps == ()
    assert not np.any(solution.state.interference_signal)


def test_separation_finds_what_object_estimation_alone_does_not():
    _, observation = simulate_preset("simulation-1", snr_db=30.0, sir_db=-30.0, seed=2)
    model, beat = model_of("simulation-1"), observation.truth.beats[0]

    def cell_error(estimator):
        beats = run(estimator, observation.received).objects.beats
        return np.min(np.abs(beats - beat), initial=1.0) * 256

    assert cell_error(FactorisedSeparator(model=model)) < 0.1
    assert cell_error(ObjectOnlySeparator(model=model)) > 0.5


def test_termination_says_why(received):
    short = FactorisedSeparator(model=model_of("simulation-2-c"), max_iterations=2)
    assert run(short, received).termination is Termination.MAX_ITERATIONS
    assert run(ESTIMATORS["robust"], received).termination is Termination.CONVERGED


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"false_alarm_rate": 0.0}, "false_alarm_rate is 0"),
        ({"false_alarm_rate": float("nan")}, "false_alarm_rate is nan"),
        ({"object_threshold_db": -3.0}, "object_threshold_db is -3 dB"),
        ({"interference_threshold_db": 1e9}, "interference_threshold_db is 1e"),
        ({"schedule": "fast"}, "schedule is 'fast'; it must be one of robust, paper"),
        ({"max_iterations": 0}, "max_iterations is 0"),
    ],
)
def test_impossible_settings_are_refused_with_their_value(settings, message):
    with pytest.raises(InputError, match=message):
        FactorisedSeparator(model=model_of("simulation-1"), **settings)


def test_threshold_in_db_wins_over_the_rate():
    model = model_of("simulation-2-a")
    assert FactorisedSeparator(model=model, object_threshold_db=9.0).threshold_db == 9.0
    rates = [FactorisedSeparator(model=model, false_alarm_rate=r).threshold_db for r in (0.01, 1.0)]
    assert rates[0] > rates[1]


def test_a_burst_that_vanishes_is_dropped(received):
    """The state of an interfered frame continued on a clean one: every burst must go."""
    estimator = ESTIMATORS["robust"]
    state = run(estimator, received).state
    _, clean = simulate_preset(
        "simulation-2-c", snr_db=60.0, sir_db=-10.0, seed=4, interference=False
    )
    continued = run(estimator, clean.received, state=dataclasses.replace(state, iteration=2))
    assert continued.state.interfered_ramps == ()


def test_without_noise_the_run_still_ends():
    _, observation = simulate_preset("simulation-1", snr_db=200.0, sir_db=0.0, seed=1)
    solution = run(FactorisedSeparator(model=model_of("simulation-1")), observation.received)
    assert solution.termination in (Termination.CONVERGED, Termination.MAX_ITERATIONS)
    error = np.min(np.abs(solution.objects.beats - observation.truth.beats[0]))
    assert error < 1e-6


def clicked_frame(level_db):
    """Twenty clicks outside of the bursts, this far above the noise."""
    _, observation = simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-10.0, seed=4)
    rng = np.random.default_rng(1)
    clear = np.flatnonzero(~observation.truth.interfered_samples(1e-9))
    places = rng.choice(clear, 20, replace=False)
    level = 10 ** (level_db / 20) / np.sqrt(observation.truth.noise_precision)
    clicked = observation.received.copy()
    clicked.ravel()[places] += level * np.exp(2j * np.pi * rng.uniform(size=20))
    return clicked, np.sort(places)


def test_exactly_the_samples_that_nothing_explains_are_set_aside(solution):
    clicked, places = clicked_frame(40.0)
    separator = ESTIMATORS["robust"]
    state = dataclasses.replace(solution.state, iteration=6, quiet_iterations=0)
    weights = separator.sample_weights(clicked, state)
    aside = np.flatnonzero(weights.values.ravel() == 0.0)
    assert set(places) <= set(aside)
    # What lies between two clicks with four samples in between at most is set aside with them.
    after = places[np.clip(np.searchsorted(places, aside), 0, len(places) - 1)]
    before = places[np.clip(np.searchsorted(places, aside, side="right") - 1, 0, None)]
    assert np.all(after - before <= 5)
    assert np.all((before <= aside) & (aside <= after))
    assert weights.num_counted == clicked.size - len(aside)
    assert separator.sample_weights(clicked, dataclasses.replace(state, iteration=5)) is None


def test_clicks_cost_no_object_and_make_none(solution):
    clicked, _ = clicked_frame(40.0)
    found = run(ESTIMATORS["robust"], clicked)
    assert found.objects.num_components == solution.objects.num_components
    offsets = np.abs(np.sort(found.objects.beats) - np.sort(solution.objects.beats))
    assert np.max(offsets) * 128 < 0.25
