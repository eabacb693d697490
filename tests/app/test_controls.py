import pytest
from vsep_app.model.settings import LOADED_FRAME, Settings, preset_values
from vsep_app.widgets.controls import Controls

from vsep.presets.registry import PRESETS


@pytest.fixture
def loaded():
    """Files that the user chose."""
    return []


@pytest.fixture
def controls(loaded):
    """Controls of the default settings."""
    return Controls(Settings(), lambda name, content: loaded.append((name, content)))


def _release(widget, value):
    """What the browser sends when a slider is dragged and released."""
    from param.parameterized import edit_constant

    widget.value = value
    with edit_constant(widget):
        widget.value_throttled = value


def test_a_slider_sets_its_setting_on_release_only(controls):
    slider = controls.widgets["snr_db"]
    slider._process_events({"value": 40.0})
    assert controls.settings.snr_db == 30.0
    _release(slider, 41.0)
    assert controls.settings.snr_db == 41.0


def test_a_value_can_be_released_again_after_something_else_has_set_another(controls):
    slider = controls.widgets["snr_db"]
    _release(slider, 41.0)
    controls.settings.snr_db = 30.0
    # A browser reports a release only if it differs from what it holds as released.
    assert slider.value_throttled == 30.0
    _release(slider, 41.0)
    assert controls.settings.snr_db == 41.0


def test_settings_show_in_the_widgets(controls):
    controls.settings.param.update(snr_db=12.0, schedule="paper", seed=99)
    assert controls.widgets["snr_db"].value == 12.0
    assert controls.widgets["schedule"].value == "paper"
    assert controls.widgets["seed"].value == 99


def test_every_control_has_words_and_a_label(controls):
    for name, widget in controls.widgets.items():
        assert widget.label, name
        assert widget.description, name


@pytest.mark.parametrize("preset", [*PRESETS])
def test_a_preset_brings_its_ranges(controls, preset):
    controls.widgets["preset"].value = preset
    assert controls.settings.preset == preset
    slope = controls.widgets["interferer_slope"]
    record = PRESETS[preset]
    assert (slope.start * 1e12, slope.end * 1e12) == record.slope_range_hz_per_s
    assert slope.value * 1e12 == record.interferer.slope_hz_per_s
    assert controls.widgets["snr_db"].disabled == (preset == "real-frame")


def test_only_the_fields_of_the_chosen_filter_show(controls):
    shown = lambda: {  # noqa: E731
        name
        for name, widget in controls.widgets.items()
        if name.startswith(("filter_", "assumed_")) and widget.visible
    }
    assert shown() == {"filter_kind", "filter_cutoff", "filter_rolloff"}
    controls.settings.param.update(filter_kind="butterworth")
    assert shown() == {"filter_kind", "filter_cutoff", "filter_order"}
    controls.settings.param.update(filter_kind="none", assume_true_filter=False)
    assert shown() == {"filter_kind", "assumed_kind", "assumed_cutoff", "assumed_rolloff"}


def test_a_loaded_frame_becomes_an_option_and_locks_the_scene(controls):
    assert LOADED_FRAME not in controls.widgets["preset"].values
    controls.settings.choose_preset(LOADED_FRAME)
    assert controls.widgets["preset"].value == LOADED_FRAME
    for name in ("snr_db", "sir_db", "seed", "interferer_slope", "filter_kind"):
        assert controls.widgets[name].disabled, name
    assert not controls.widgets["false_alarm_rate"].disabled


def test_the_measured_filter_is_offered_with_a_frame_that_brings_it(controls):
    kinds = controls.widgets["assumed_kind"]
    assert "measured" not in kinds.values
    controls.fit_frame(20e6, measured=True)
    assert "measured" in kinds.values
    assert controls.settings.assumed_cutoff == 5.0
    controls.settings.assumed_kind = "measured"
    controls.fit_frame(10e6, measured=False)
    assert "measured" not in kinds.values
    assert controls.settings.assumed_kind == "raised_cosine"


def test_an_upload_is_stored_on_with_its_name(controls, loaded):
    controls.upload.param.update(filename="mine.npz", value=b"content")
    assert loaded == [("mine.npz", b"content")]


def test_widgets_start_from_a_link():
    controls = Controls(
        Settings(**preset_values("simulation-2-a") | {"false_alarm_rate": 0.2}), lambda *_: None
    )
    assert controls.widgets["interferer_slope"].value == 9.8321
    assert controls.widgets["false_alarm_rate"].value == 0.2
    assert controls.widgets["preset"].value == "simulation-2-a"


def test_a_released_slider_of_rates_sets_the_rate_not_its_place():
    controls = Controls(Settings(), lambda *_: None)
    slider = controls.widgets["false_alarm_rate"]
    # What the browser sends: the place of the value while it is dragged, and again on release.
    for message in ({"value": 6}, {"value": 7}, {"value_throttled": 7}):
        slider._process_events(message)
    assert slider.values[7] == 1.0
    assert controls.settings.false_alarm_rate == slider.value == 1.0
    slider._process_events({"value": 0, "value_throttled": 0})
    assert controls.settings.false_alarm_rate == 0.001


def test_a_slider_of_rates_sets_nothing_before_its_release(controls):
    controls.widgets["false_alarm_rate"]._process_events({"value": 7})
    assert controls.settings.false_alarm_rate == 0.05


def test_a_number_field_sets_its_setting_within_bounds(controls):
    controls.widgets["seed"].value = 12
    assert controls.settings.seed == 12
    controls.widgets["max_iterations"].value = 9999
    assert controls.settings.max_iterations == controls.widgets["max_iterations"].value == 500
    controls.widgets["seed"].value = None
    assert controls.settings.seed == 12


def test_a_threshold_takes_the_place_of_the_false_alarm_rate_until_it_is_cleared(controls):
    field, rate = (controls.widgets[n] for n in ("object_threshold_db", "false_alarm_rate"))
    assert (field.value, rate.disabled) == ("", False)
    field.value = "9.123456789"
    assert controls.settings.object_threshold_db == 9.123456789
    assert rate.disabled
    for text in ("loud", "1000", "nan"):
        field.value = text
        assert field.error_state
        assert controls.settings.object_threshold_db == 9.123456789
    field.value = " "
    assert controls.settings.object_threshold_db is None
    assert (field.error_state, rate.disabled) == (False, False)
    controls.settings.object_threshold_db = 11.0
    assert field.value == "11.0"


def test_a_widget_that_is_made_late_looks_as_if_it_had_been_there_always():
    early, late = Controls(Settings(), lambda *_: None), Controls(Settings(), lambda *_: None)
    there = list(early.widgets.values())
    late.layout()
    assert sum(len(group.widgets.made) for group in late._groups) < len(there) / 2
    for controls in early, late:
        controls.lock(["order", "seed"], ["wind"])
        controls.settings.param.update(
            preset="simulation-2-b",
            assume_true_filter=False,
            assumed_kind="butterworth",
            filter_kind="butterworth",
            object_threshold_db=9.0,
            estimator="object-only",
            interference=False,
            snr_db=33.0,
        )
        controls.fit_frame(20e6, measured=True)
        controls.settings.choose_preset(LOADED_FRAME)
    shown = ("disabled", "visible", "value", "start", "end", "options")
    for name, widget in early.widgets.items():
        for one in shown:
            assert getattr(late.widgets[name], one, None) == getattr(widget, one, None), (name, one)
