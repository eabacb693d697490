import dataclasses
import pickle

import pytest
from vsep_app.jobs.tasks import recorded_frame
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, VIEW_NAMES, Settings, preset_values
from vsep_app.model.url import QUERY_NAMES, parse_query

from vsep.presets.registry import PRESET_NAMES, PRESETS
from vsep.presets.scenes import interferer_sequence, preset_radar

REAL_FRAME = "real-frame"


def test_every_preset_and_a_loaded_frame_can_be_set():
    assert Settings.param.preset.objects == [*PRESETS, LOADED_FRAME]
    assert {*PRESETS} == {*PRESET_NAMES, REAL_FRAME}


@pytest.mark.parametrize("name", PRESET_NAMES)
def test_defaults_are_those_of_the_simulator(name):
    values, radar = preset_values(name), preset_radar(name)
    sequence = interferer_sequence(name)
    assert values["interferer_slope"] * 1e12 == pytest.approx(sequence.slope_hz_per_s, rel=1e-12)
    assert values["filter_cutoff"] * 1e6 == pytest.approx(radar.sample_rate_hz / 4.0, rel=1e-12)


def test_the_radar_of_the_real_frame_is_that_of_its_file():
    preset = PRESETS[REAL_FRAME]
    assert recorded_frame(preset).radar == preset.radar


@pytest.mark.parametrize("name", [*PRESETS])
def test_defaults_lie_inside_of_their_ranges(name):
    values = preset_values(name)
    for setting, (lowest, highest) in PRESETS[name].ranges().items():
        assert lowest <= values[setting] <= highest
    Settings(**values)


def test_every_setting_is_in_the_address_and_has_words():
    names = {name for name in Settings.param if name != "name"}
    assert names == set(QUERY_NAMES) == {*PLAN_NAMES, *VIEW_NAMES}
    assert len(set(QUERY_NAMES.values())) == len(QUERY_NAMES)
    assert all(Settings.param[name].doc for name in names)


def test_plan_is_a_frozen_picklable_copy():
    settings = Settings(seed=3)
    plan = settings.plan()
    settings.seed = 4
    assert pickle.loads(pickle.dumps(plan)) == plan
    assert plan.seed == 3
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.seed = 5


def test_choosing_a_preset_takes_its_levels_in_one_event():
    settings, events = Settings(burst_shift=2.0, ramp=0), []
    settings.param.watch(lambda *changes: events.append(changes), list(PLAN_NAMES))
    settings.choose_preset("simulation-2-b")
    assert len(events) == 1
    assert (settings.snr_db, settings.sir_db) == (60.0, -20.0)
    assert settings.interferer_slope == 9.7122
    assert settings.burst_shift == 0.0


def test_values_outside_of_the_bounds_are_refused():
    settings = Settings()
    with pytest.raises(ValueError, match="snr_db"):
        settings.snr_db = 1e9
    assert settings.snr_db == 30.0


def test_a_link_names_only_what_it_changes():
    values, errors = parse_query({"preset": "simulation-2-a", "sir": "-5", "matched": False})
    assert errors == []
    assert values["sir_db"] == -5.0
    assert values["snr_db"] == 60.0
    assert values["assume_true_filter"] is False
    assert "seed" not in values


def test_a_link_written_by_the_page_is_read_back():
    settings = Settings(
        preset="simulation-2-c",
        snr_db=41.5,
        interferer_slope=9.4,
        filter_cutoff=1.0,
        assumed_kind="butterworth",
        assume_true_filter=False,
        false_alarm_rate=0.3,
    )
    query = {key: getattr(settings, name) for name, key in QUERY_NAMES.items()}
    values, errors = parse_query(query | {"assumed_cutoff": 1.0})
    assert errors == []
    expected = {name: getattr(settings, name) for name in QUERY_NAMES} | {"assumed_cutoff": 1.0}
    assert values == expected


@pytest.mark.parametrize(
    ("query", "sentence"),
    [
        ({"snr": "abc"}, "snr is abc; it must be a number between -10 and 90."),
        ({"snr": "NaN"}, "snr is NaN; it must be a number between -10 and 90."),
        ({"snr": True}, "snr is True; it must be a number between -10 and 90."),
        ({"sir": 1e9}, "sir is 1000000000.0; it must be a number between -50 and 40."),
        ({"seed": 2.5}, "seed is 2.5; it must be a whole number between 0 and 999999."),
        ({"speed": [1]}, "speed is [1]; it must be a whole number between 1 and 30."),
        ({"interference": "maybe"}, "interference is maybe; it must be true or false."),
        ({"schedule": "fast"}, "schedule is fast; it must be one of robust, paper."),
        ({"slope": 99}, "slope is 99; it must be a number between 8 and 12."),
        ({"preset": LOADED_FRAME}, "A link cannot carry a loaded frame; load its file again."),
    ],
)
def test_a_bad_value_of_a_link_is_one_sentence_and_changes_nothing(query, sentence):
    values, errors = parse_query(query)
    assert errors == [sentence]
    assert values == {}


def test_a_slope_unfit_for_the_preset_falls_back_to_its_own():
    values, errors = parse_query({"preset": REAL_FRAME, "slope": "9.2"})
    assert len(errors) == 1
    assert values["interferer_slope"] == 59.9


def test_strange_names_in_a_link_are_ignored():
    assert parse_query({"utm_source": "mail"}) == ({}, [])
