"""The controls: widgets made from `Settings`, which they set when a slider is released.

A widget never starts anything itself. It sets a setting; whoever watches the settings restarts the
run or redraws the view.
"""

from collections.abc import Callable
from typing import Any

import panel as pn
import panel_material_ui as pmu
import param

from vsep_app.model.settings import FALSE_ALARM_RATES, LOADED_FRAME, PRESETS, REAL_FRAME, Settings
from vsep_app.widgets.layout import heading, number_or_nothing, small_text

_TIGHT = {"sizing_mode": "stretch_width", "size": "small"}
_SLIDER_MARGIN = (0, 22, 0, 18)
_SELECT_MARGIN = (6, 16, 6, 16)
_FILTER_LABELS = {
    "Raised cosine": "raised_cosine",
    "Butterworth": "butterworth",
    "None": "none",
    "Measured": "measured",
}
_MODEL_LABELS = {
    "Multiplicative (12)": "multiplicative",
    "Convolution (40)": "convolution",
    "Convolution with ramp edges": "convolution-with-edges",
}


class Controls:
    """All controls of the side bar; `settings` holds their state.

    Parameters
    ----------
    settings : Settings
        Read and set by the widgets.
    load : callable
        Takes name and content of a frame file that the user chose.
    """

    def __init__(self, settings: Settings, load: Callable[[str, bytes], None]) -> None:
        self.settings = settings
        self._load = load
        self.widgets: dict[str, Any] = {}
        self._make_scene()
        self._make_filters()
        self._make_estimator()
        self.upload = pmu.FileInput(
            label="Load a frame file (.npz)",
            accept=".npz",
            variant="outlined",
            size="small",
            description="A recorded frame: complex samples of all ramps with the radar's settings.",
            sizing_mode="stretch_width",
            margin=_SELECT_MARGIN,
        )
        self.upload.param.watch(self._uploaded, "value")
        self.levels = pn.pane.HTML("", sizing_mode="stretch_width", margin=(2, 16, 2, 17))
        self.threshold = pn.pane.HTML("", sizing_mode="stretch_width", margin=(0, 16, 0, 17))
        settings.param.watch(
            self._arrange,
            [
                "preset",
                "filter_kind",
                "assume_true_filter",
                "assumed_kind",
                "estimator",
                "interference",
                "object_threshold_db",
            ],
        )
        self._arrange()
        self._offer_measured(settings.assumed_kind == "measured")

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        pick = self.widgets
        return [
            *self.scene(),
            heading("Estimator"),
            pn.Row(pick["estimator"], pick["schedule"], sizing_mode="stretch_width"),
            *self.thresholds(),
            self.upload,
        ]

    def scene(self) -> list[Any]:
        """Return what makes the frame."""
        pick = self.widgets
        return [
            heading("Scene"),
            pick["preset"],
            pick["snr_db"],
            pick["sir_db"],
            self.levels,
            pick["interferer_slope"],
            pick["burst_shift"],
            pick["interference_model"],
            pn.Row(pick["seed"], pick["interference"], sizing_mode="stretch_width"),
            heading("Anti-aliasing filter"),
            pick["filter_kind"],
            pick["filter_cutoff"],
            pick["filter_rolloff"],
            pick["filter_order"],
            pick["assume_true_filter"],
            pick["assumed_kind"],
            pick["assumed_cutoff"],
            pick["assumed_rolloff"],
            pick["assumed_order"],
        ]

    def thresholds(self) -> list[Any]:
        """Return what decides on objects and when to stop."""
        pick = self.widgets
        return [
            pick["false_alarm_rate"],
            pick["object_threshold_db"],
            self.threshold,
            pick["max_iterations"],
        ]

    def _make_scene(self) -> None:
        options = {ranges.label: name for name, ranges in PRESETS.items()}
        preset = pmu.Select(
            label="Preset",
            options=options,
            value=self.settings.preset,
            description=Settings.param.preset.doc,
            margin=_SELECT_MARGIN,
            **_TIGHT,
        )
        self.widgets["preset"] = preset
        preset.param.watch(self._preset_chosen, "value")
        self.settings.param.watch(self._show_preset, "preset")
        self._slider("snr_db", start=-10.0, end=90.0, step=1.0)
        self._slider("sir_db", start=-50.0, end=40.0, step=1.0)
        self._slider("interferer_slope", step=0.01, format="0.000")
        self._slider("burst_shift", step=0.1)
        self._select("interference_model", _MODEL_LABELS)
        self._number("seed")
        self._switch("interference")
        self.widgets["seed"].param.update(sizing_mode=None, width=116)
        self.widgets["interference"].margin = (8, 0, 0, 0)

    def _make_filters(self) -> None:
        self._select("filter_kind", dict(list(_FILTER_LABELS.items())[:3]))
        self._switch("assume_true_filter")
        self._select("assumed_kind", _FILTER_LABELS)
        for which in ("filter", "assumed"):
            self._slider(f"{which}_cutoff", step=0.005, format="0.000")
            self._slider(f"{which}_rolloff", start=0.05, end=1.0, step=0.05)
            self._slider(f"{which}_order", start=1, end=12, step=1)

    def _make_estimator(self) -> None:
        names = {"Factorised": "factorised", "Joint": "joint", "Object-only": "object-only"}
        self._select("estimator", names)
        self._select("schedule", {"Robust": "robust", "Paper": "paper"})
        rates = sorted({*FALSE_ALARM_RATES, self.settings.false_alarm_rate})
        parameter = Settings.param.false_alarm_rate
        rate = pmu.DiscreteSlider(
            label=parameter.label,
            description=parameter.doc,
            options=rates,
            value=self.settings.false_alarm_rate,
            margin=_SLIDER_MARGIN,
            **_TIGHT,
        )
        self._bind("false_alarm_rate", rate, "value_throttled")
        self._optional_number("object_threshold_db", placeholder="from the false alarms")
        self._number("max_iterations")

    def _slider(self, name: str, **options: Any) -> None:
        parameter = Settings.param[name]
        value = getattr(self.settings, name)
        whole = isinstance(value, int)
        options.setdefault("start", min(value, 0))
        options.setdefault("end", value + 1)
        kind = pmu.IntSlider if whole else pmu.FloatSlider
        slider = kind(
            label=parameter.label,
            description=parameter.doc,
            value=value,
            margin=_SLIDER_MARGIN,
            **_TIGHT,
            **options,
        )
        self._bind(name, slider, "value_throttled")

    def _select(self, name: str, options: dict[str, str]) -> None:
        parameter = Settings.param[name]
        select = pmu.Select(
            label=parameter.label,
            description=parameter.doc,
            options=options,
            value=getattr(self.settings, name),
            margin=_SELECT_MARGIN,
            **_TIGHT,
        )
        self._bind(name, select, "value")

    def _number(self, name: str) -> None:
        parameter = Settings.param[name]
        lowest, highest = parameter.bounds
        number = pmu.IntInput(
            label=parameter.label,
            description=parameter.doc,
            start=lowest,
            end=highest,
            value=getattr(self.settings, name),
            margin=_SELECT_MARGIN,
            **_TIGHT,
        )
        # The browser sets "value" once the user leaves the field; "value_throttled" it never sets.
        self._bind(name, number, "value")

    def _optional_number(self, name: str, *, placeholder: str) -> None:
        """Make a field that may be empty; what is no such number is marked and changes nothing."""
        parameter = Settings.param[name]
        field = pmu.TextInput(
            label=parameter.label,
            description=parameter.doc,
            placeholder=placeholder,
            margin=_SELECT_MARGIN,
            **_TIGHT,
        )
        self.widgets[name] = field

        def take(event: Any) -> None:
            try:
                self.settings.param.update(**{name: number_or_nothing(event.new)})
                field.error_state = False
            except ValueError:
                field.error_state = True

        def show(*_: Any) -> None:
            value = getattr(self.settings, name)
            field.value = "" if value is None else repr(value)

        show()
        field.param.watch(take, "value")
        self.settings.param.watch(show, name)

    def _switch(self, name: str) -> None:
        parameter = Settings.param[name]
        switch = pmu.Switch(
            label=parameter.label,
            description=parameter.doc,
            value=getattr(self.settings, name),
            margin=(0, 12, 0, 18),
            **_TIGHT,
        )
        self._bind(name, switch, "value")

    def _bind(self, name: str, widget: Any, committed: str) -> None:
        """Let the widget set the setting when the user commits, and show it in any case."""
        self.widgets[name] = widget

        parameter = Settings.param[name]

        def take(event: Any) -> None:
            if event.new is None:
                return
            within = isinstance(parameter, param.Number)
            value = parameter.crop_to_bounds(event.new) if within else event.new
            self.settings.param.update(**{name: value})
            if value != event.new:
                widget.value = value

        def show(event: Any) -> None:
            if widget.value != event.new:
                widget.value = event.new
            if committed != "value":
                # The browser reports changes only: the value committed last can be set again.
                with param.edit_constant(widget):
                    widget.param.update(**{committed: event.new})

        widget.param.watch(take, committed)
        self.settings.param.watch(show, name)

    def _preset_chosen(self, event: Any) -> None:
        if event.new != self.settings.preset:
            self.settings.choose_preset(event.new)

    def _show_preset(self, event: Any) -> None:
        select = self.widgets["preset"]
        if event.new == LOADED_FRAME and LOADED_FRAME not in select.values:
            select.options = {**select.options, "Loaded frame": LOADED_FRAME}
        select.value = event.new

    def _uploaded(self, event: Any) -> None:
        if event.new:
            self._load(self.upload.filename or "frame.npz", event.new)

    def _arrange(self, *_: Any) -> None:
        """Show what has a meaning for the scene, with its ranges."""
        settings, pick = self.settings, self.widgets
        ranges = PRESETS.get(settings.preset)
        if ranges is not None:
            shift = ranges.shift_range
            for name, (start, end) in (
                ("interferer_slope", ranges.slope_range),
                ("filter_cutoff", ranges.cutoff_range),
                ("assumed_cutoff", ranges.cutoff_range),
                ("burst_shift", (-shift, shift)),
            ):
                pick[name].param.update(start=start, end=end, value=getattr(settings, name))
        loaded, real = settings.preset == LOADED_FRAME, settings.preset == REAL_FRAME
        pick["snr_db"].disabled = loaded or real
        pick["seed"].disabled = loaded
        for name in ("sir_db", "interferer_slope", "burst_shift", "interference_model"):
            pick[name].disabled = loaded or not settings.interference
        for name in (
            "interference",
            "filter_kind",
            "filter_cutoff",
            "filter_rolloff",
            "filter_order",
        ):
            pick[name].disabled = loaded
        pick["filter_rolloff"].visible = settings.filter_kind == "raised_cosine"
        pick["filter_order"].visible = settings.filter_kind == "butterworth"
        pick["filter_cutoff"].visible = settings.filter_kind != "none"
        apart = not settings.assume_true_filter
        pick["assumed_kind"].visible = apart
        pick["assumed_cutoff"].visible = apart and settings.assumed_kind in (
            "raised_cosine",
            "butterworth",
        )
        pick["assumed_rolloff"].visible = apart and settings.assumed_kind == "raised_cosine"
        pick["assumed_order"].visible = apart and settings.assumed_kind == "butterworth"
        pick["schedule"].disabled = settings.estimator == "object-only"
        pick["false_alarm_rate"].disabled = settings.object_threshold_db is not None

    def show_levels(self, text: str) -> None:
        """Show SNR and SIR in both conventions."""
        self.levels.object = small_text(text)

    def show_threshold(self, threshold_db: float) -> None:
        """Show the object threshold, as it is given or follows from the false-alarm rate."""
        self.threshold.object = small_text(f"Object threshold {threshold_db:.1f} dB")

    def fit_frame(self, sample_rate_hz: float, *, measured: bool) -> None:
        """Suit the assumed filter to a loaded frame; measured only where the frame brings it."""
        rate_mhz = sample_rate_hz / 1e6
        self._offer_measured(measured)
        self.settings.assumed_cutoff = rate_mhz / 4.0
        self.widgets["assumed_cutoff"].param.update(
            start=rate_mhz / 16.0, end=rate_mhz / 2.0, step=rate_mhz / 1000.0, value=rate_mhz / 4.0
        )

    def _offer_measured(self, offered: bool) -> None:
        kinds = dict(_FILTER_LABELS)
        if not offered:
            kinds.pop("Measured")
            if self.settings.assumed_kind == "measured":
                self.settings.assumed_kind = "raised_cosine"
        self.widgets["assumed_kind"].options = kinds
