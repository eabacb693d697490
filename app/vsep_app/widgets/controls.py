"""The controls of the side bar: groups of widgets, one for each record of a setting."""

from abc import ABC, abstractmethod
from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import panel as pn
import panel_material_ui as pmu

from vsep.inference.registry import ESTIMATORS
from vsep.parameters import (
    ESTIMATOR_PARAMETERS,
    FILTER_PARAMETERS,
    FILTER_PARTS,
    PARAMETERS,
    SCENE_PARAMETERS,
)
from vsep.parameters.receiver import RECEIVER_PARAMETERS
from vsep.presets.record import RecordedPreset
from vsep.presets.registry import PRESETS
from vsep_app.model.crossing import Courses
from vsep_app.model.settings import (
    ESTIMATOR,
    LOADED_FRAME,
    PLACED,
    PRESET,
    SETTINGS,
    Plan,
    Settings,
)
from vsep_app.widgets.fields import field, file_field
from vsep_app.widgets.fold import Fold
from vsep_app.widgets.layout import heading, small_text
from vsep_app.widgets.setting_widgets import SettingWidgets

_MAIN = ("preset", "snr_db", "sir_db", "interferer_slope", "burst_shift")
_LAST = ("seed", "interference")
_IN_SIGHT = ("filter_kind", "filter_cutoff")
_PRODUCT, _CONVOLUTION = "multiplicative", "convolution"
_EQUAL_SLOPES = (
    "This is your own radar's slope: mixed with your ramp the other chirp is a steady tone, as an "
    "object is. The multiplicative model has no such burst, so the convolution is used."
)


def has_equal_slopes(settings: Settings | Plan) -> bool:
    """Whether the other radar of a preset has the slope of the victim."""
    preset, record = PRESETS.get(settings.preset), PARAMETERS["interferer_slope"]
    if preset is None or not settings.interference:
        return False
    return bool(record.in_si(settings.interferer_slope) == preset.radar.slope_hz_per_s)


def slope_remark(courses: Courses) -> str:
    """Say what happens where a chirp has the victim's slope; nothing if none has."""
    return "" if np.all(courses.slopes) else _EQUAL_SLOPES


class Group(ABC):
    """Widgets of some settings, and what becomes of them beside the others."""

    widgets: SettingWidgets

    @abstractmethod
    def look(self, name: str, settings: Settings, *, loaded: bool) -> dict[str, Any]:
        """Return the parameters of a widget that depend on other settings."""

    def arrange(self, settings: Settings, *, loaded: bool) -> None:
        """Show what has a meaning, of the widgets that there are."""
        for name, widget in tuple(self.widgets.made.items()):
            _change(widget, **self.look(name, settings, loaded=loaded))


class SceneControls(Group):
    """What makes the frame: preset, levels, the other radar, seed."""

    def __init__(self, settings: Settings) -> None:
        self.widgets = SettingWidgets(settings, (PRESET, *SCENE_PARAMETERS, PLACED))
        self.widgets.put("preset", _preset_select(settings))
        self.levels = pn.pane.HTML("", sizing_mode="stretch_width", margin=(2, 16, 2, 17))
        self.slope_note = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 2, 17))

    def layout(self) -> list[Any]:
        """Return the group."""
        return [*self.main(), *self.more()]

    def main(self) -> list[Any]:
        """Return what is in sight; seed and interference share the last line."""
        lines = [self.widgets[name] for name in _MAIN]
        lines.insert(lines.index(self.widgets["sir_db"]) + 1, self.levels)
        lines.insert(lines.index(self.widgets["interferer_slope"]) + 1, self.slope_note)
        seed, interference = (self.widgets[name] for name in _LAST)
        seed.param.update(sizing_mode=None, width=116)
        interference.margin = (8, 0, 0, 0)
        pair = pn.Row(seed, interference, sizing_mode="stretch_width")
        return [heading("Scene"), *lines, pair]

    def more(self) -> list[Any]:
        """Return the rest."""
        receiver = [each.name for each in RECEIVER_PARAMETERS]
        above = (*_MAIN, *_LAST, *receiver)
        errors = [self.widgets[name] for name in receiver]
        lines = [self.widgets[name] for name in self.widgets if name not in above]
        return [*lines, heading("Oscillator and receiver"), *errors]

    def look(self, name: str, settings: Settings, *, loaded: bool) -> dict[str, bool]:
        """Return what becomes of a widget: what has a meaning for the preset can be set."""
        recorded = isinstance(PRESETS.get(settings.preset), RecordedPreset)
        record = SETTINGS[name]
        unused = recorded and not record.of_recording
        silent = record.of_bursts and not settings.interference
        return {"disabled": record is not PRESET and (loaded or unused or silent)}

    def suit_model(self, settings: Settings) -> None:
        """At the victim's slope take the convolution: the product form has no such burst."""
        equal = has_equal_slopes(settings)
        self.slope_note.object = small_text(_EQUAL_SLOPES) if equal else ""
        if equal and settings.interference_model == _PRODUCT:
            settings.interference_model = _CONVOLUTION


class FilterControls(Group):
    """The anti-aliasing filter: the true one, and what the estimator assumes."""

    def __init__(self, settings: Settings) -> None:
        self.widgets = SettingWidgets(settings, FILTER_PARAMETERS)
        self._offers_measured = True

    def layout(self) -> list[Any]:
        """Return the group."""
        return [*self.main(), *self.more()]

    def main(self) -> list[Any]:
        """Return the true filter, without the form of its edges."""
        return [heading("Anti-aliasing filter"), *(self.widgets[name] for name in _IN_SIGHT)]

    def more(self) -> list[Any]:
        """Return the rest."""
        return [self.widgets[name] for name in self.widgets if name not in _IN_SIGHT]

    def look(self, name: str, settings: Settings, *, loaded: bool) -> dict[str, Any]:
        """Return what becomes of a widget: the fields of the chosen kinds are shown."""
        which, _, part = name.partition("_")
        if part not in ("kind", "cutoff", "rolloff", "order"):
            return {}
        of_assumed = which == "assumed"
        kind = settings.assumed_kind if of_assumed else settings.filter_kind
        look: dict[str, Any] = {
            "visible": (part == "kind" or part in FILTER_PARTS[kind])
            and not (of_assumed and settings.assume_true_filter),
            "disabled": loaded and not of_assumed,
        }
        if name == "assumed_kind":
            kinds = PARAMETERS[name].choices or {}
            look["value"] = settings.assumed_kind
            look["options"] = {
                label: kind
                for kind, label in kinds.items()
                if self._offers_measured or kind != "measured"
            }
        return look

    def offer_measured(self, settings: Settings, *, offered: bool) -> None:
        """Offer the measured filter of a frame that brings one, from the next look on."""
        self._offers_measured = offered
        if not offered and settings.assumed_kind == "measured":
            settings.assumed_kind = "raised_cosine"


class EstimatorControls(Group):
    """The estimator, what decides on objects, and when to stop."""

    def __init__(self, settings: Settings) -> None:
        self.widgets = SettingWidgets(settings, (ESTIMATOR, *ESTIMATOR_PARAMETERS))
        self.threshold = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 0, 17))

    def layout(self) -> list[Any]:
        """Return the group."""
        pair = self.widgets["estimator"], self.widgets["schedule"]
        row = pn.Row(*pair, sizing_mode="stretch_width")
        return [heading("Estimator"), row, *self.thresholds()]

    def thresholds(self) -> list[Any]:
        """Return what decides on objects and when to stop."""
        names = [name for name in self.widgets if name not in ("estimator", "schedule")]
        lines = [self.widgets[name] for name in names]
        lines.insert(names.index("object_threshold_db") + 1, self.threshold)
        return lines

    def look(self, name: str, settings: Settings, *, loaded: bool) -> dict[str, bool]:
        """Return what becomes of a widget: disabled if it plays no part, in any frame."""
        del loaded
        if name == "schedule":
            return {"disabled": "schedule" not in ESTIMATORS[settings.estimator].settings}
        by_hand = settings.object_threshold_db is not None
        return {"disabled": name == "false_alarm_rate" and by_hand}


class Controls:
    """All controls of the side bar; `settings` holds their state.

    `load` takes name and content of a frame file that the user chose, `moved` is called while a
    slider of scene or filter moves.
    """

    def __init__(
        self,
        settings: Settings,
        load: Callable[[str, bytes], None],
        moved: Callable[[], None] = lambda: None,
    ) -> None:
        self.settings = settings
        #: Whether the settings of the scene are those of the frame that is loaded.
        self.keeps_scene = False
        self._locked: frozenset[str] = frozenset()
        self._hidden: frozenset[str] = frozenset()
        self._load = load
        self._scene = SceneControls(settings)
        self._filters = FilterControls(settings)
        self._estimator = EstimatorControls(settings)
        self._groups = (self._scene, self._filters, self._estimator)
        groups: list[Any] = [each.widgets for each in self._groups]
        self.widgets: Mapping[str, Any] = ChainMap(*groups)
        text = "A recorded frame: complex samples of all ramps with the radar's settings."
        self.upload = file_field("Load a frame file (.npz)", text, ".npz")
        self.refused = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 8, 17))
        self.upload.param.watch(self._uploaded, "value")
        scene = self._scene
        settings.param.watch(
            lambda *_: scene.suit_model(settings),
            ["preset", "interferer_slope", "interference_model", "interference"],
        )
        scene.suit_model(settings)
        settings.param.watch(self._arrange, [name for name in self.widgets if _decides(name)])
        self._moved = moved
        self._sliders: dict[str, Any] = {}
        self._filters.offer_measured(settings, offered=settings.assumed_kind == "measured")
        for group in self._groups:
            group.widgets.was_made = self._was_made
        self._arrange()

    def moving_plan(self) -> Plan:
        """Return the plan that the sliders show, which is that of the settings once they rest."""
        shown = {
            name: Settings.param[name].crop_to_bounds(widget.value)
            for name, widget in self._sliders.items()
            if widget.value is not None
        }
        plan: Plan = replace(self.settings.plan(), **shown)
        if plan.interference_model == _PRODUCT and has_equal_slopes(plan):
            plan = replace(plan, interference_model=_CONVOLUTION)
        return plan

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        scene, filters = self._scene, self._filters
        fold = Fold("More controls", "More controls: model, filter, estimator, file.", self.folded)
        return [*scene.main(), *filters.main(), *fold.layout()]

    def folded(self) -> list[Any]:
        """Return what the side bar shows on demand only."""
        groups = self._scene.more(), self._filters.more(), self._estimator.layout()
        return [*(line for group in groups for line in group), self.upload, self.refused]

    def scene(self) -> list[Any]:
        """Return what makes the frame."""
        return [*self._scene.layout(), *self._filters.layout()]

    def thresholds(self) -> list[Any]:
        """Return what decides on objects and when to stop."""
        return self._estimator.thresholds()

    def lock(self, names: Iterable[str], hidden: Iterable[str] = ()) -> None:
        """Let the controls of these settings stand still, hide some, and those of no others."""
        for name, widget in self._made():
            if name in self._locked:
                widget.disabled = False
            if name in self._hidden:
                widget.visible = True
        self._hidden = frozenset(name for name in hidden if name in self.widgets)
        self._locked = self._hidden | {name for name in names if name in self.widgets}
        self._arrange()

    def show_levels(self, text: str) -> None:
        """Show SNR and SIR in both conventions."""
        self._scene.levels.object = small_text(text)

    def show_refused(self, sentence: str) -> None:
        """Show below the field of the file why it is not used."""
        self.upload.param.update(uploaded_label="Refused {filename}", color="error")
        self.refused.object = f'<div role="alert">{small_text(sentence)}</div>'

    def show_threshold(self, threshold_db: float) -> None:
        """Show the object threshold, as it is given or follows from the false-alarm rate."""
        self._estimator.threshold.object = small_text(f"Object threshold {threshold_db:.1f} dB")

    def fit_frame(self, sample_rate_hz: float, *, measured: bool) -> None:
        """Suit the assumed filter to a loaded frame; measured only where the frame brings it."""
        rate_mhz = sample_rate_hz / 1e6
        self._filters.offer_measured(self.settings, offered=measured)
        self._arrange()
        self.settings.assumed_cutoff = rate_mhz / 4.0
        self.widgets["assumed_cutoff"].param.update(
            start=rate_mhz / 16.0, end=rate_mhz / 2.0, step=rate_mhz / 1000.0, value=rate_mhz / 4.0
        )

    def _made(self) -> list[tuple[str, Any]]:
        return [each for group in self._groups for each in group.widgets.made.items()]

    def _was_made(self, name: str) -> None:
        """Take in a widget that somebody has asked for."""
        widget = self.widgets[name]
        is_slider = isinstance(widget, pmu.FloatSlider | pmu.IntSlider)
        if is_slider and name not in self._estimator.widgets:
            self._sliders[name] = widget
            widget.param.watch(lambda _: self._moved(), "value")
        self._arrange()

    def _arrange(self, *_: Any) -> None:
        """Show what has a meaning for the scene, with its ranges."""
        loaded = self.settings.preset == LOADED_FRAME and not self.keeps_scene
        for group in self._groups:
            group.arrange(self.settings, loaded=loaded)
        preset = PRESETS.get(self.settings.preset)
        ranges = {} if preset is None else preset.ranges()
        for name, widget in self._made():
            if name in self._locked:
                widget.disabled = True
            if name in self._hidden:
                widget.visible = False
            if name in ranges:
                start, end = ranges[name]
                _change(widget, start=start, end=end, value=getattr(self.settings, name))

    def _uploaded(self, event: Any) -> None:
        if event.new:
            self.upload.param.update(uploaded_label="Uploaded {filename}", color="primary")
            self.refused.object = ""
            self._load(self.upload.filename or "frame.npz", event.new)


def _change(widget: Any, **values: Any) -> None:
    """Set what has another value: an update costs as much where nothing changes."""
    changed = {name: value for name, value in values.items() if getattr(widget, name) != value}
    if changed:
        widget.param.update(**changed)


def _decides(name: str) -> bool:
    """Whether other widgets depend on a setting: choices, switches, fields that may be empty."""
    record = SETTINGS[name]
    return record.choices is not None or record.optional or isinstance(record.default, bool)


def _preset_select(settings: Settings) -> Any:
    """Return the choice of presets; a loaded frame is one of them once there is one."""
    options = {preset.label: name for name, preset in PRESETS.items()}
    select = field(
        pmu.Select, PRESET.form_label, PRESET.help, options=options, value=settings.preset
    )

    def choose(event: Any) -> None:
        if event.new != settings.preset:
            settings.choose_preset(event.new)

    def show(event: Any) -> None:
        if event.new == LOADED_FRAME and LOADED_FRAME not in select.values:
            assert PRESET.choices is not None
            select.options = {**select.options, PRESET.choices[LOADED_FRAME]: LOADED_FRAME}
        select.value = event.new

    select.param.watch(choose, "value")
    settings.param.watch(show, "preset")
    return select
