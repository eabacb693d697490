"""Guided experiments: every file reads, and what its answer claims is true on its own seed."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from vsep_app.assets import folder
from vsep_app.jobs.tasks import advance, prepare
from vsep_app.model.compare_settings import ComparePlan
from vsep_app.model.picture import make_picture
from vsep_app.model.score import score_of
from vsep_app.model.settings import PLAN_NAMES, Settings
from vsep_app.model.url import QUERY_NAMES
from vsep_app.pages.compare.metrics import judge_objects
from vsep_app.pages.compare.tasks import advance as advance_all
from vsep_app.pages.compare.tasks import prepare as prepare_all
from vsep_app.teaching.experiment import (
    COMPARE,
    LIVE,
    open_experiment,
    read_experiment,
    read_experiments,
    shipped_experiments,
)

from vsep.errors import InputError
from vsep.grouping.groups import find_groups
from vsep.inference.core.progress import Termination
from vsep.inference.waveforms import recognised_waveforms

TEXT = """
title = "Title"
setting = "Setting."
question = "Question?"
watch = "Watch."
answer = "Answer."
"""


@pytest.fixture
def write(tmp_path):
    def write(content, name="own.toml"):
        path = tmp_path / name
        path.write_text(content, encoding="utf-8")
        return path

    return write


def named(name):
    return next(one for one in shipped_experiments() if one.name == name)


class Outcome:
    """The end of a run."""

    def __init__(self, prepared, steps):
        verdict = judge_objects(prepared.observation.truth, steps[-1].state)
        self.misses, self.false_alarms = verdict
        self.score = score_of(prepared.static_picture, steps[-1].state.objects)
        self.iterations, self.termination = len(steps), steps[-1].termination
        self.objects, self.bursts = steps[-1].state.objects, steps[-1].state.bursts
        self.radar, self.truth = prepared.static_picture.radar, prepared.observation.truth
        self.receiver = steps[-1].state.receiver
        received = prepared.static_picture.observation.received
        self.state, self.received = steps[-1].state, received
        picture = make_picture(
            prepared.static_picture, prepared.initial_state, steps, num_iterations=len(steps)
        )
        self.targets = picture.targets
        self.groups = find_groups(received, steps[-1].state, self.radar)
        self.threshold_db = prepared.estimator.threshold_db
        power = 1.0 / (steps[-1].state.noise_precision * prepared.static_picture.reference_power)
        self.noise_db = 10.0 * math.log10(power)

    @property
    def ranges_m(self):
        return np.sort(self.radar.range_from_beat(self.objects.beats))

    @property
    def missed_m(self):
        true = self.radar.range_from_beat(self.truth.beats)
        return sorted(round(float(r), 1) for r in true if np.abs(self.ranges_m - r).min() > 0.3)


@cache
def run(name, **changes):
    """Run an experiment of the live view as its file says, with a control or two moved."""
    settings = Settings(**{**named(name).settings(), **changes})
    prepared = prepare(settings.plan())
    steps = [advance(prepared, prepared.initial_state)]
    while steps[-1].termination is Termination.RUNNING:
        steps.append(advance(prepared, steps[-1].state))
    return Outcome(prepared, steps)


def test_there_are_fifteen_in_their_order():
    names = ["pedestrian", "zeroing", "dip", "threshold", "filter", "same-slope", "oscillator"]
    names += ["moving-car", "braking", "dithered-ramps", "extended-car", "four-radars"]
    names += ["no-chirps", "tone", "two-transmitters"]
    assert [one.name for one in shipped_experiments()] == names
    assert {one.name for one in shipped_experiments() if one.page == COMPARE} == {"zeroing"}


@pytest.mark.parametrize("path", sorted(folder("experiments").iterdir()), ids=lambda p: p.stem)
def test_every_file_sets_what_it_says(path):
    experiment = read_experiment(path)
    settings = Settings(**experiment.settings())
    for name, key in QUERY_NAMES.items():
        if key in experiment.query:
            assert getattr(settings, name) == experiment.query[key]
    assert set(PLAN_NAMES) <= set(experiment.settings())
    assert experiment.question.endswith("?")
    # One sentence or two: it has to be read beside the views.
    assert len(experiment.setting) < 260


def test_the_pedestrian_is_lost_and_found():
    lost, found = run("pedestrian"), run("pedestrian", estimator="factorised")
    assert lost.missed_m == [8.1, 9.3, 13.5, 14.4, 16.3]
    assert (lost.misses, lost.false_alarms) == (5, 0)
    # "about 0 dB" and "-27 dB"
    assert (round(lost.noise_db), round(found.noise_db)) == (0, -27)
    assert (found.misses, found.false_alarms, len(found.bursts)) == (0, 0, 4)
    at = int(np.argmin(np.abs(found.radar.range_from_beat(found.objects.beats) - 14.4)))
    assert found.radar.range_from_beat(found.objects.beats)[at] == pytest.approx(14.4, abs=0.05)
    speed = found.radar.velocity_from_doppler(found.objects.dopplers)[at]
    assert speed == pytest.approx(1.0, abs=0.05)


def test_the_periods_of_a_tone_are_a_range():
    experiment, outcome = named("tone"), run("tone")
    radar = outcome.radar
    (beat_hz,) = outcome.truth.beats * radar.sample_rate_hz
    assert beat_hz * 10e-6 == pytest.approx(8.0, abs=0.05)
    ramp_s = radar.num_samples / radar.sample_rate_hz
    assert (ramp_s, 1.0 / ramp_s) == pytest.approx((25.1e-6, 40e3), rel=0.005)
    assert radar.range_from_beat(1.0 / radar.num_samples) == pytest.approx(0.60, abs=0.005)
    scene = prepare(Settings(**experiment.settings()).plan()).static_picture
    right = [experiment.ask.is_right(each, scene) for each in (12.0, 11.6, 12.6, 24.0)]
    assert right == [True, True, False, False]
    assert (outcome.misses, outcome.false_alarms) == (0, 0)


def came(name, score):
    """The beginning of the one prediction that holds."""
    (text,) = [each.text for each in named(name).staging.predictions if each.holds(score)]
    return text[:44]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pedestrian", "Half of them: the weak ones drown."),
        ("dip", "Some are lost, though all four bursts are fo"),
        ("threshold", "Ten objects and several false ones."),
        ("filter", "One object, and many false ones."),
        ("same-slope", "Two objects: the other radar looks like one."),
        ("oscillator", "Ten objects: what the receiver makes is told"),
        ("moving-car", "One car, and several objects around it that "),
        ("extended-car", "The stronger points, and no line of the car."),
        ("braking", "Five, and others around the strong ones that"),
        ("no-chirps", "All ten objects: what is no chirp is left ou"),
        pytest.param("four-radars", "A few, and many that are none.", marks=pytest.mark.slow),
        ("dithered-ramps", "All twelve, as the starts are known."),
        ("two-transmitters", "Twenty-four, two for each object."),
    ],
)
def test_one_prediction_is_right_on_its_own_seed(name, text):
    assert came(name, run(name).score) == text
    assert len(named(name).staging.predictions) == 3


def test_the_arrow_points_at_the_pedestrian():
    zoom, truth = named("pedestrian").staging.zoom, run("pedestrian").truth
    radar = run("pedestrian").radar
    ranges, velocities = (
        radar.range_from_beat(truth.beats),
        radar.velocity_from_doppler(truth.dopplers),
    )
    at = int(np.argmin(np.abs(ranges - zoom.arrow[0])))
    assert (ranges[at], velocities[at]) == pytest.approx(zoom.arrow, abs=0.05)
    assert zoom.range[0] < ranges[at] < zoom.range[1]
    assert zoom.velocity[0] < velocities[at] < zoom.velocity[1]


def test_zeroing_leaves_ghosts():
    experiment = named("zeroing")
    plan = ComparePlan(
        scene=Settings(**experiment.settings()).plan(),
        **{**experiment.choice(), "methods": tuple(experiment.choice()["methods"])},
        frame_number=0,
        histories={},
        past=(),
    )
    comparison = prepare_all(plan)
    # "a fifth of them"
    assert comparison.method_runs[0].mask.mean() == pytest.approx(0.2, abs=0.02)
    step = advance_all(comparison, comparison.initial_state)
    while step.termination is Termination.RUNNING:
        step = advance_all(comparison, step.state)
    assert came("zeroing", step.views[0].score) == "Zeroing finds dozens of objects that are not"
    zeroing, masked, factorised = (view.metrics for view in step.views)
    # "about 80 false ones", "and it has not ended"
    assert 75 <= zeroing.false_alarms <= 85
    assert zeroing.num_detections == plan.scene.max_iterations
    assert (masked.misses, masked.false_alarms) == (0, 0)
    assert (factorised.misses, factorised.false_alarms) == (0, 0)
    errors = [m.windowed_error_db for m in (zeroing, masked, factorised)]
    assert errors == pytest.approx([-9.0, -28.0, -28.0], abs=1.0)


def test_the_letter_loses_objects_under_strong_bursts():
    literal, robust = run("dip"), run("dip", schedule="robust")
    assert literal.termination is Termination.MAX_ITERATIONS
    true_ramps = {burst.ramp for burst in literal.truth.bursts}
    assert {burst.ramp for burst in literal.bursts if len(burst.active_bins)} == true_ramps
    assert (literal.misses, literal.false_alarms) == (pytest.approx(4, abs=1), 0)
    assert (round(literal.noise_db), round(robust.noise_db)) == (pytest.approx(-4, abs=1), -27)
    assert run("dip", sir_db=-30.0).misses == pytest.approx(7, abs=1)
    assert run("dip", sir_db=0.0).misses == 0
    longer = run("dip", max_iterations=60)
    assert longer.termination is Termination.MAX_ITERATIONS
    assert longer.misses >= literal.misses
    assert run("dip", sir_db=15.0).false_alarms == pytest.approx(7, abs=2)
    assert run("dip", sir_db=15.0, max_iterations=60).false_alarms == 0
    assert {burst.ramp for burst in robust.bursts} == true_ramps
    assert (robust.misses, robust.false_alarms, len(robust.objects.beats)) == (0, 0, 10)
    assert robust.iterations == pytest.approx(12, abs=2)


def test_nine_decibels_are_many_false_alarms():
    fixed, chosen = run("threshold"), run("threshold", object_threshold_db=None)
    assert (fixed.misses, fixed.false_alarms) == (0, 8)
    assert (chosen.misses, chosen.false_alarms) == (0, 0)
    assert round(chosen.threshold_db, 1) == 11.2
    threshold = 10.0**0.9
    assert round(16 * 128 * math.pi * threshold / 3.0 * math.exp(-threshold)) == 6
    one_ramp = 256 * math.sqrt(math.pi * threshold / 3.0) * math.exp(-threshold)
    assert round(one_ramp, 1) == 0.3
    # "some twenty times as many"
    assert 16 * 128 * math.pi * threshold / 3.0 * math.exp(-threshold) / one_ramp > 20.0


def test_a_wrong_filter_makes_false_objects():
    wrong, right = run("filter"), run("filter", assume_true_filter=True)
    assert (wrong.misses, wrong.false_alarms, len(wrong.bursts)) == (0, 20, 1)
    assert (right.misses, right.false_alarms) == (0, 0)
    assert run("filter", sir_db=-10.0).false_alarms == 0
    assert run("filter", estimator="factorised").false_alarms == 0


def test_the_same_slope_cannot_be_separated():
    same = run("same-slope")
    assert (same.misses, same.false_alarms, len(same.bursts)) == (0, 1, 0)
    assert same.ranges_m == pytest.approx([0.0, 12.0], abs=0.05)
    by_range = np.argsort(same.objects.beats)
    levels = 20.0 * np.log10(np.abs(same.objects.amplitudes[by_range]))
    # Both are tones, so the ratio of energies is the SIR of -20 dB.
    assert levels[0] - levels[1] == pytest.approx(20.0, abs=0.5)
    for slope in (9.8, 9.2):
        apart = run("same-slope", interferer_slope=slope)
        assert (apart.misses, apart.false_alarms, len(apart.bursts)) == (0, 0, 1)


def test_an_oscillator_and_a_receiver_are_corrected():
    bad = run("oscillator")
    assert (bad.misses, bad.false_alarms, len(bad.objects.beats)) == (0, 0, 10)
    truth, receiver = bad.truth.receiver, bad.receiver
    assert 20.0 * math.log10(abs(truth.image_factor)) == pytest.approx(-28.0, abs=0.5)
    assert receiver.image_factors[0] == pytest.approx(truth.image_factor, abs=1e-3)
    assert 1e3 * receiver.prior.jitter_std == pytest.approx(5.0, abs=2.0)
    perfect = run("oscillator", phase_jitter=0.0, iq_gain=0.0, iq_phase=0.0)
    assert perfect.receiver is None
    both = run("oscillator", phase_noise=10.0, dc_offset=5.0)
    assert (both.misses, both.false_alarms) == (0, 0)
    assert abs(both.receiver.offsets[0] - both.truth.receiver.offset) < 0.1 * abs(
        both.truth.receiver.offset
    )


def test_a_folder_of_ones_own_is_read_in_order(write, tmp_path):
    write(TEXT, "b.toml")
    write(TEXT + "[values]\nsnr = 12\n", "2-a.toml")
    write("no experiment", "readme.txt")
    experiments = read_experiments(tmp_path)
    assert [one.name for one in experiments] == ["a", "b"]
    assert experiments[0].settings()["snr_db"] == 12.0
    assert experiments[1].link == "./?experiment=b"


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (
            "title = ",
            "The experiment own.toml cannot be read (Invalid value (at end of document)).",
        ),
        ('title = "T"', "The experiment own.toml: it has no text 'setting'."),
        (TEXT.replace('"Answer."', "3"), "The experiment own.toml: it has no text 'answer'."),
        (TEXT + 'colour = "red"', "it has 'colour'; it may have title, setting"),
        (TEXT + 'page = "studies"', "its page is 'studies'; it must be one of live, compare."),
        (TEXT + "page = []", "its page is []; it must be one of live, compare."),
        (TEXT + f"page = {'[' * 20_000}", "cannot be read (it is nested too deeply)"),
        (TEXT + f"[values]\nsnr = {'9' * 5000}", "cannot be read (Exceeds the limit"),
        (TEXT + f"[values]\nsnr = {'9' * 4000}", "it must be a number between -10 and 90."),
        (TEXT + "[values]\npreset = [1]", "preset is [1]; it must be one of simulation-1"),
        (TEXT + "values = 3", "its values are no table; write them below a line [values]."),
        (TEXT + "[values]\nloudness = 3", "it sets 'loudness'; it may set preset, snr"),
        (TEXT + '[values]\nmask = "truth"', "it sets 'mask'; it may set preset, snr"),
        (TEXT + "[values]\nsnr = 300", "snr is 300; it must be a number between -10 and 90."),
        (TEXT + "[values]\nslope = 60", "slope is 60; it must be a number between 8 and 12."),
        (TEXT + '[values]\npreset = "night"', "preset is night; it must be one of simulation-1"),
        (TEXT + 'page = "compare"\n[values]\nmethods = "iht"', "The number of methods is 1; it"),
        (TEXT + 'show = "sir"', "its show is 'sir'; it must be a list of words."),
        (TEXT + 'lock = ["colour"]', "its lock has 'colour'; it may have preset, snr"),
        (TEXT + 'hide = ["sky"]', "its hide has 'sky'; it may have chirps, fast_time, delay"),
        (TEXT + "predict = 3", "its predict is no list of tables; begin each with a line"),
        (TEXT + '[[predict]]\ntext = "A"\nfound = 1', "it has 1 predictions; it may have 2 to 5"),
        (TEXT + 2 * '[[predict]]\ntext = "A"\n', "a prediction says neither found nor false"),
        (TEXT + 2 * "[[predict]]\nfound = 1\n", "a prediction has no text."),
        (TEXT + 2 * '[[predict]]\ntext = "A"\nfound = [3, 1]\n', "found of a prediction is [3, 1]"),
        (TEXT + 2 * '[[predict]]\ntext = "A"\nfound = true\n', "found of a prediction is True; it"),
        (TEXT + 2 * "[[predict]]\nhits = 1\n", "a prediction has 'hits'; it may have text, found"),
        (TEXT + "zoom = 3", "its zoom is no table; write it below a line [zoom]."),
        (TEXT + "[zoom]\nrange = [5, 5]", "range of its zoom is [5, 5]; the smaller end is first."),
        (TEXT + "[zoom]\nheight = [5, 6]", "its zoom has 'height'; it may have range, velocity"),
        (TEXT + "[zoom]\narrow = [5]", "arrow of its zoom is [5]; it must be two numbers."),
        (TEXT + "[zoom]\nlabel = 5", "label of its zoom is 5; it must be a text."),
    ],
)
def test_a_bad_file_is_one_sentence(write, content, sentence):
    with pytest.raises(InputError) as told:
        read_experiment(write(content))
    assert sentence in str(told.value)
    assert str(told.value).startswith("The experiment own.toml")


def test_a_bad_name_or_folder_is_one_sentence(write, tmp_path):
    with pytest.raises(InputError, match=r"My File.toml needs a file name of small letters"):
        read_experiment(write(TEXT, "My File.toml"))
    with pytest.raises(InputError, match=r"The experiment none\.toml does not exist"):
        read_experiment(tmp_path / "none.toml")
    with pytest.raises(InputError, match="is not there"):
        read_experiments(tmp_path / "none")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no experiment"):
        read_experiments(tmp_path / "empty")
    for number in (1, 2):
        write(TEXT, f"empty/{number}-night.toml")
    with pytest.raises(InputError, match="Two experiments are named night"):
        read_experiments(tmp_path / "empty")


def test_an_address_opens_an_experiment_and_its_own_values_count_first():
    query = {"experiment": "pedestrian", "seed": "7"}
    opened, experiment, told = open_experiment(query, shipped_experiments(), LIVE)
    assert experiment.name == "pedestrian"
    assert (opened["seed"], opened["estimator"], told) == ("7", "object-only", [])


def test_an_experiment_of_another_page_sets_nothing():
    query = {"experiment": "pedestrian"}
    opened, experiment, told = open_experiment(query, shipped_experiments(), COMPARE)
    assert (opened, experiment.name, told) == (query, "pedestrian", [])


def test_an_unknown_experiment_is_told():
    opened, experiment, told = open_experiment({"experiment": "x"}, shipped_experiments(), LIVE)
    assert (opened, experiment) == ({"experiment": "x"}, None)
    assert told[0].startswith("experiment is x; it must be one of pedestrian, zeroing")


def test_an_experiment_is_a_frozen_record():
    with pytest.raises(dataclasses.FrozenInstanceError):
        named("dip").title = "another"


def test_a_moving_car_is_nine_objects_or_one():
    still, moving = run("moving-car"), run("moving-car", range_migration="modelled")
    assert (still.misses, still.objects.num_components) == (0, 9)
    power_db = 20.0 * np.log10(np.abs(still.objects.amplitudes / still.truth.amplitudes[0]))
    four = np.argsort(-power_db)[:4]
    assert power_db[four[0]] == pytest.approx(-4.7, abs=0.1)
    away_m = np.abs(still.radar.range_from_beat(still.objects.beats[four]) - 20.0)
    away_mps = np.abs(still.radar.velocity_from_doppler(still.objects.dopplers[four]) - 15.0)
    assert away_m.max() == pytest.approx(0.09, abs=0.005)
    assert away_mps.max() == pytest.approx(0.14, abs=0.01)
    assert moving.ranges_m == pytest.approx([20.0], abs=0.0005)
    velocity = moving.radar.velocity_from_doppler(moving.objects.dopplers)
    assert velocity == pytest.approx([15.0], abs=0.0005)
    ten = [
        run("moving-car", num_objects=10, range_migration=choice).objects.num_components
        for choice in ("modelled", "neglected")
    ]
    assert ten == [10, 17]


def test_a_car_that_no_line_shows_is_a_group():
    hidden, seen, lost = (run("extended-car", snr_db=level) for level in (30.0, 40.0, 28.0))
    of_car = hidden.truth.groups == 0
    levels = 10.0 * np.log10(np.abs(hidden.truth.amplitudes) ** 2 * hidden.truth.noise_precision)
    assert of_car.sum() == 4
    assert (round(levels[of_car].min()), round(levels[of_car].max())) == (10, 13)
    assert (round(levels[~of_car].min()), round(levels[~of_car].max())) == (4, 23)
    assert hidden.threshold_db > 12.0
    (group,) = hidden.groups
    assert (len(group.members), group.num_lines) == (0, 4)
    assert (group.range_m, group.velocity_mps) == pytest.approx((9.66, 11.98), abs=0.005)
    assert group.extent_m == pytest.approx(3.39, abs=0.005)
    true_m = hidden.radar.range_from_beat(hidden.truth.beats[of_car])
    true_mps = hidden.radar.velocity_from_doppler(hidden.truth.dopplers[of_car])
    assert np.ptp(true_m) == pytest.approx(3.38, abs=0.005)
    assert (true_m.min() + true_m.max()) / 2.0 == pytest.approx(9.68, abs=0.005)
    assert true_mps.mean() == pytest.approx(11.97, abs=0.005)
    (group,) = seen.groups
    assert len(group.members) == 4
    assert math.exp(group.log_odds) == pytest.approx(650.0, rel=0.05)
    assert (seen.misses, seen.false_alarms, lost.groups) == (0, 0, ())


def test_five_objects_that_brake_are_thirteen_or_five():
    constant, braking = run("braking"), run("braking", acceleration="modelled")
    levels = 10.0 * np.log10(np.abs(braking.truth.amplitudes) ** 2 * braking.truth.noise_precision)
    assert (round(levels.min()), round(levels.max())) == (27, 55)
    assert constant.objects.num_components == 13
    assert np.sum(np.abs(constant.ranges_m - 1.37) < 0.1) == 4
    assert (braking.misses, braking.false_alarms) == (0, 0)
    found = braking.radar.acceleration_from_curvature(braking.objects.curvatures)
    strongest = int(np.argmax(braking.objects.powers))
    assert found[strongest] == pytest.approx(9.99, abs=0.005)
    still = run("braking", acceleration="modelled", object_acceleration=0.0)
    assert still.objects.curvatures is None
    assert still.objects.num_components == 5


def test_what_is_no_chirp_is_left_out():
    shares = {"phase-coded": 0.22, "ofdm": 0.19, "stepped": 0.25}
    for waveform, share in shares.items():
        outcome = run("no-chirps", interferer_waveform=waveform)
        assert (outcome.misses, outcome.false_alarms, len(outcome.bursts)) == (0, 0, 0)
        assert np.mean(outcome.state.noise_like) == pytest.approx(share, abs=0.005)
        (found,) = recognised_waveforms(outcome.state, outcome.radar, outcome.received)
        assert (found.waveform, found.num_bursts) == (waveform, 4)


@pytest.mark.slow
def test_four_radars_make_many_objects_or_none():
    outcome, separated = run("four-radars"), run("four-radars", estimator="factorised")
    levels = 10.0 * np.log10(np.abs(outcome.truth.amplitudes) ** 2 * outcome.truth.noise_precision)
    assert (round(levels.min()), round(levels.max())) == (23, 33)
    assert (outcome.misses, outcome.false_alarms) == (8, 56)
    assert (separated.misses, separated.false_alarms) == (0, 0)
    found = recognised_waveforms(separated.state, separated.radar)
    assert [(each.waveform, each.num_bursts) for each in found] == [("chirps", 32)] * 4


def test_dithered_ramps_keep_objects_and_move_bursts():
    outcome = run("dithered-ramps")
    assert (outcome.misses, outcome.false_alarms) == (0, 0)
    assert len({burst.ramp for burst in outcome.truth.bursts}) == 25
    starts = np.array([burst.start_frequency_hz for burst in outcome.truth.bursts])
    crossings = -starts / outcome.truth.bursts[0].slope_hz_per_s * outcome.radar.sample_rate_hz
    assert np.std(crossings) > 20.0  # samples


def test_lines_of_two_transmitters_are_joined():
    two, one = run("two-transmitters"), run("two-transmitters", doppler_division="none")
    assert (two.misses, two.false_alarms, two.objects.num_components) == (0, 0, 24)
    assert len(two.targets.ranges_m) == 12
    interval = two.radar.velocity_from_doppler(1.0)
    assert (interval, interval / 3.0) == pytest.approx((64.9, 21.6), abs=0.05)
    own = np.sort(two.radar.velocity_from_doppler(two.truth.dopplers[:12]))
    assert np.sort(two.targets.velocities_mps) == pytest.approx(own, abs=0.2)
    assert (one.misses, one.objects.num_components, one.targets) == (0, 12, None)
