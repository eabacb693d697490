import pickle
from dataclasses import replace

import numpy as np
import pytest
from vsep_app.jobs.tasks import advance, compact, compose, prepare, recorded_frame
from vsep_app.model.settings import LOADED_FRAME, Settings, preset_values
from vsep_app.views.tables import table_html

from tests.app.conftest import FinishedRun
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.files.results import result_line
from vsep.inference.core.progress import Solution, Termination
from vsep.presets import real_frame
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.scenes import simulate_preset
from vsep.presets.settings import chosen_filter
from vsep.signal.filters import MeasuredFilter
from vsep.signal.linear_array import UniformLinearArray


def _plan(preset="simulation-1", **changes):
    return Settings(**{**preset_values(preset), **changes}).plan()


@pytest.mark.parametrize("name", ["simulation-1", "simulation-2-a", "simulation-2-b"])
def test_the_default_plan_is_the_frame_of_the_command_line(name):
    plan = _plan(name, seed=11)
    _, expected = simulate_preset(name, snr_db=plan.snr_db, sir_db=plan.sir_db, seed=11)
    received = prepare(plan).observation.received
    # The dashboard gives the slope in MHz/us; Table I is met to the last digit of a double.
    assert np.max(np.abs(received - expected.received)) <= 1e-6 * np.max(np.abs(received))


def test_a_step_is_picklable_and_does_not_depend_on_the_process():
    prepared = pickle.loads(pickle.dumps(prepare(_plan())))
    again = prepare(_plan())
    first, second = (advance(run, run.initial_state) for run in (prepared, again))
    assert first.state.noise_precision == second.state.noise_precision
    assert np.array_equal(first.state.interference_signal, second.state.interference_signal)


def test_switching_interference_off_leaves_objects_and_noise():
    with_bursts = prepare(_plan("simulation-2-a")).observation
    without = prepare(_plan("simulation-2-a", interference=False)).observation
    difference = with_bursts.received - with_bursts.truth.interference_signal - without.received
    assert np.max(np.abs(difference)) < 1e-12 * np.max(np.abs(with_bursts.received))


def test_the_burst_moves_by_what_the_slider_says():
    def centre(shift):
        prepared = prepare(_plan(burst_shift=shift))
        power = np.abs(prepared.observation.truth.interference_signal[0]) ** 2
        return np.sum(power * prepared.static_picture.times_us) / np.sum(power)

    # The burst keeps its shape while it stays inside the ramp; samples are 0.098 us apart.
    assert centre(3.0) - centre(0.0) == pytest.approx(3.0, abs=0.05)
    assert centre(-3.0) - centre(0.0) == pytest.approx(-3.0, abs=0.05)


def test_parallel_chirps_are_one_sentence():
    with pytest.raises(InputError, match="slope"):
        prepare(_plan(interferer_slope=10.0))


def test_true_and_assumed_filter_are_two_settings():
    plan = _plan(
        filter_kind="butterworth",
        filter_order=4,
        assume_true_filter=False,
        assumed_kind="raised_cosine",
        assumed_cutoff=2.0,
    )
    assumed = prepare(plan).estimator.model.anti_aliasing_filter
    assert (assumed.kind, assumed.cutoff_hz) == ("raised_cosine", 2e6)
    matched = prepare(replace(plan, assume_true_filter=True)).estimator.model.anti_aliasing_filter
    assert (matched.kind, matched.order) == ("butterworth", 4)


@pytest.mark.parametrize("kind", ["raised_cosine", "butterworth", "none"])
def test_filters_are_made_in_the_units_of_the_controls(kind):
    parts = {"kind": kind, "cutoff": 2.55, "rolloff": 0.25, "order": 8}
    made = chosen_filter({f"assumed_{part}": value for part, value in parts.items()}, "assumed")
    assert made.kind == kind
    if kind != "none":
        # Half amplitude at the cutoff, for every kind.
        assert abs(made.response(np.array([2.55e6]))[0]) == pytest.approx(0.5)


def test_estimator_settings_reach_the_estimator():
    plan = _plan("simulation-2-a", schedule="paper", false_alarm_rate=1.0, max_iterations=7)
    strict = prepare(replace(plan, false_alarm_rate=0.01)).estimator
    estimator = prepare(plan).estimator
    assert estimator.max_iterations == 7
    assert estimator.threshold_db < strict.threshold_db
    object_only = prepare(replace(plan, estimator="object-only"))
    step = advance(object_only, object_only.initial_state)
    assert step.state.interfered_ramps == ()


def test_the_real_frame_gets_bursts_in_every_fourth_ramp_at_the_wanted_level():
    observation = prepare(_plan("real-frame")).observation
    truth, recorded = observation.truth, recorded_frame(real_frame.PRESET).received
    ramps = sorted({burst.ramp for burst in truth.bursts})
    assert set(np.diff(ramps)) == {real_frame.EVERY}
    assert len(ramps) == recorded.shape[0] // real_frame.EVERY
    energies = [np.sum(np.abs(x) ** 2) for x in (recorded, truth.interference_signal)]
    assert 10.0 * np.log10(energies[0] / energies[1]) == pytest.approx(-10.0)


def test_nothing_stands_still_in_the_real_frame():
    received = recorded_frame(real_frame.PRESET).received
    assert np.median(received.real, axis=0) == pytest.approx(0.0, abs=1e-9)
    assert np.median(received.imag, axis=0) == pytest.approx(0.0, abs=1e-9)


def test_the_real_frame_without_interference_is_as_recorded():
    observation = prepare(_plan("real-frame", interference=False)).observation
    assert np.array_equal(observation.received, recorded_frame(real_frame.PRESET).received)


def test_no_loaded_frame_is_one_sentence():
    with pytest.raises(InputError, match="No frame is loaded"):
        prepare(_plan(preset=LOADED_FRAME))


def _loaded(small_radar, **changes):
    rng = np.random.default_rng(3)
    received = rng.normal(size=small_radar.shape) + 1j * rng.normal(size=small_radar.shape)
    return Frame(received=received, radar=small_radar, name="mine.npz", **changes)


def test_a_loaded_frame_brings_its_filter(small_radar):
    frequency = np.linspace(-2e6, 2e6, 33)
    measured = MeasuredFilter(frequency_hz=frequency, response=np.ones(33, dtype=complex))
    frame = _loaded(small_radar, anti_aliasing_filter=measured)
    plan = _plan(preset=LOADED_FRAME, assume_true_filter=False, assumed_kind="measured")
    prepared = prepare(plan, frame)
    assert prepared.estimator.model.anti_aliasing_filter is measured
    assert prepared.static_picture.title == "mine.npz"


def test_ramps_of_the_same_slope_are_missing_by_choice(small_radar):
    radar = replace(small_radar, num_ramps=16)
    draws = np.random.default_rng(6).standard_normal((2, *radar.shape))
    received = draws[0] + 1j * draws[1]
    received[3] += 30.0 * np.exp(2j * np.pi * 0.2 * np.arange(radar.num_samples))
    frame = Frame(received=received, radar=radar, name="tone")
    for choice, expected in (("kept", None), ("set-aside", [3])):
        plan = Settings(preset=LOADED_FRAME, same_slope=choice).plan()
        missing = prepare(plan, frame).estimator.missing
        ramps = None if missing is None else np.flatnonzero(missing.all(axis=1)).tolist()
        assert ramps == expected


def test_a_measured_filter_that_is_not_there_is_one_sentence(small_radar):
    plan = _plan(preset=LOADED_FRAME, assume_true_filter=False, assumed_kind="measured")
    with pytest.raises(InputError, match="no loaded frame brings one"):
        prepare(plan, _loaded(small_radar))


@pytest.fixture(scope="module")
def array_run():
    """Three antennas that receive Simulation II a, after ten iterations."""
    line = UniformLinearArray(num_antennas=3, spacing_wavelengths=0.4)
    scenario, observation = simulate_preset_antennas(
        "simulation-2-a", line, snr_db=50.0, sir_db=-10.0, seed=3
    )
    truth = observation.truth
    frame = Frame(
        received=observation.received[0],
        radar=scenario.radar,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        truth=truth.of_antenna(0),
        antennas=observation.received,
        antenna_spacing_wavelengths=0.4,
        antennas_truth=truth,
    )
    prepared = prepare(Settings(preset=LOADED_FRAME).plan(), frame)
    states = [prepared.initial_state]
    steps = []
    for _ in range(10):
        steps.append(advance(prepared, states[-1]))
        states.append(steps[-1].state)
    return FinishedRun(prepared, (*map(compact, steps[:-1]), steps[-1])), frame


def test_angles_of_antennas_together_stand_beside_their_truth(array_run):
    run, frame = array_run
    picture = compose(run.snapshot(), 0, "level", 0)
    found = [row for row in picture.table if row.component_id is not None]
    matched = [row for row in found if row.true_angle_deg is not None]
    assert len(matched) >= 8
    # Objects that share a cell pull at each other, which the deviations do not know; of the others
    # half would lie beyond two deviations once in 1e5 frames.
    errors = [(row.angle_deg - row.true_angle_deg) / row.angle_std_deg for row in matched]
    assert np.median(np.abs(errors)) < 2.0
    assert "angle [°]" in table_html(picture.table, moving=True)
    solution = Solution(
        state=run.steps[-1].state, termination=Termination.RUNNING, infos=(), seconds=0.0
    )
    told = result_line("a.npz", solution, frame.radar, 0.4)["objects"]
    assert sorted(each["angle_deg"] for each in told) == sorted(row.angle_deg for row in found)


def test_each_antenna_is_seen_with_its_own_signals(array_run):
    run, frame = array_run
    state, num_ramps = run.steps[-1].state, frame.radar.num_ramps
    for antenna in range(3):
        picture = compose(run.snapshot(), 3, "real", antenna)
        assert picture.static_picture.antenna.number == antenna
        np.testing.assert_array_equal(picture.fast_time.received, frame.antennas[antenna, 3].real)
        row = antenna * num_ramps + 3
        np.testing.assert_array_equal(
            picture.fast_time.interference, state.interference_signal[row].real
        )
        powers = np.abs(state.objects.amplitudes[:, antenna]) ** 2 / num_ramps
        np.testing.assert_allclose(
            picture.objects.levels_db, picture.static_picture.level_db(powers)
        )


def test_joint_takes_the_antenna_that_is_chosen(array_run):
    _, frame = array_run
    prepared = prepare(Settings(preset=LOADED_FRAME, estimator="joint").plan(), frame, 2)
    assert (prepared.num_antennas, len(prepared.static_pictures)) == (3, 1)
    np.testing.assert_array_equal(prepared.observation.received, frame.antennas[2])
    np.testing.assert_array_equal(
        prepared.observation.truth.object_signal, frame.antennas_truth.object_signal[2]
    )
