"""Side bar of the separability page: scene, two axes, all other values, number of trials."""

from collections.abc import Callable
from typing import Any

import numpy as np
import panel as pn
import panel_material_ui as pmu

from vsep.errors import InputError
from vsep.presets.registry import PRESET_NAMES, PRESETS
from vsep.presets.scenes import preset_radar
from vsep.separability.axes import AXES, Axis
from vsep.separability.map_spec import MAX_TRIALS, MapSpec, default_value
from vsep.studies.methods import estimator_names
from vsep.studies.study import TrialSettings
from vsep_app.widgets.fields import field, number_field, pair
from vsep_app.widgets.layout import heading

_COUNTS = (9, 17, 33, 65)
_MAX_SEED = 2**53 - 1


class SeparabilityForm:
    """The side bar of the separability page.

    It begins with a spec; `changed` is called after every change of a control.
    """

    def __init__(self, spec: MapSpec, changed: Callable[[], None]) -> None:
        self._changed, self._quiet = changed, False
        self.scene = field(
            pmu.Select,
            "Scene",
            "Radar, objects and paths of Table I; the rest is on the axes and below.",
            options={PRESETS[name].label: name for name in PRESET_NAMES},
            value=spec.scene,
        )
        self.axes = {name: _AxisChoice(getattr(spec, name)) for name in ("x", "y")}
        self.values = {name: self._slider(name) for name in AXES}
        self.method = field(
            pmu.Select,
            "Estimator",
            "The estimator that the trials run.",
            options=list(estimator_names()),
            value=spec.method,
        )
        self.trials = number_field(
            "Trials per cell",
            "Frames the estimator is tried on in every cell; 0 tries none.",
            spec.trials,
            *(0, MAX_TRIALS),
        )
        self.seed = number_field(
            "Seed",
            "Draws objects, paths and noise, the same in all cells.",
            spec.settings.seed,
            *(0, _MAX_SEED),
        )
        self._arrange(dict(spec.fixed))
        self.scene.param.watch(self._scene_chosen, "value")
        for choice in self.axes.values():
            choice.watch(self._axes_chosen, self._edited)
        for widget in (self.method, self.trials, self.seed):
            widget.param.watch(self._edited, "value")
        for slider in self.values.values():
            slider.param.watch(self._edited, "value_throttled")

    def layout(self) -> list[Any]:
        """Return the side bar from top to bottom."""
        return [
            self.scene,
            heading("Horizontal axis"),
            *self.axes["x"].layout(),
            heading("Vertical axis"),
            *self.axes["y"].layout(),
            heading("Fixed values"),
            *self.values.values(),
            heading("Trials"),
            self.method,
            pn.Row(self.trials, self.seed, sizing_mode="stretch_width"),
        ]

    def spec(self) -> MapSpec:
        """Return what is asked; `InputError` if it cannot be answered."""
        if self.trials.value is None or self.seed.value is None:
            raise InputError("Trials or seed are empty; both must be integers.")
        scene = self.scene.value
        fixed = []
        for name, slider in self.values.items():
            own = default_value(scene, name) / AXES[name].scale
            if slider.visible and not np.isclose(slider.value, own, rtol=1e-9, atol=1e-12):
                fixed.append((name, float(f"{slider.value * AXES[name].scale:.12g}")))
        return MapSpec(
            x=self.axes["x"].axis(),
            y=self.axes["y"].axis(),
            scene=scene,
            fixed=tuple(fixed),
            method=self.method.value,
            trials=self.trials.value,
            settings=TrialSettings(seed=self.seed.value),
        )

    def _slider(self, name: str) -> Any:
        kind = AXES[name]
        start, stop = kind.offered
        return field(
            pmu.FloatSlider,
            kind.label[:1].upper() + kind.label[1:],
            "",
            start=start,
            end=stop,
            step=kind.step,
            value=start,
        )

    def _scene_chosen(self, _: Any) -> None:
        self._arrange({})
        self._edited()

    def _axes_chosen(self) -> None:
        self._arrange({name: None for name in AXES})
        self._edited()

    def _edited(self, *_: Any) -> None:
        if not self._quiet:
            self._changed()

    def _arrange(self, given: dict[str, float] | dict[str, None]) -> None:
        """Show the sliders that mean something; values that are given, or the scene's own.

        A value of None leaves a slider where it is.
        """
        scene, on_axes = self.scene.value, {choice.name for choice in self.axes.values()}
        one_ramp = preset_radar(scene).num_ramps == 1
        self._quiet = True
        try:
            for name, slider in self.values.items():
                kind, own = AXES[name], default_value(scene, name)
                # Of several objects the first one's delay is drawn.
                without = {"object_delay_s": np.isnan(own), "interfered_share": one_ramp}
                slider.visible = name not in on_axes and not without.get(name, False)
                value = given.get(name, own)
                if value is not None and np.isfinite(value):
                    shown = value / kind.scale
                    ends = kind.offered
                    slider.param.update(
                        start=min(ends[0], shown), end=max(ends[1], shown), value=shown
                    )
        finally:
            self._quiet = False


class _AxisChoice:
    """Which parameter is on an axis, from where to where, in how many steps."""

    def __init__(self, axis: Axis) -> None:
        kind = axis.kind
        names = {one.title if one.convention else one.help: name for name, one in AXES.items()}
        self.parameter = field(pmu.Select, "Parameter", "", options=names, value=axis.name)
        self.start = field(pmu.TextInput, "From", "", value=_text(axis.start / kind.scale))
        self.stop = field(pmu.TextInput, "To", "", value=_text(axis.stop / kind.scale))
        counts = sorted({*_COUNTS, axis.count})
        self.count = field(pmu.Select, "Values", "", options=counts, value=axis.count)
        self._quiet = False

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return str(self.parameter.value)

    def layout(self) -> list[Any]:
        """Return the controls."""
        return [self.parameter, pair(self.start, self.stop), self.count]

    def watch(self, chosen: Callable[[], None], edited: Callable[..., None]) -> None:
        """Call one function for another parameter, the other for another range."""

        def choose(event: Any) -> None:
            kind = AXES[event.new]
            self._quiet = True
            try:
                self.start.value = _text(kind.offered[0])
                self.stop.value = _text(kind.offered[1])
            finally:
                self._quiet = False
            chosen()

        def edit(*_: Any) -> None:
            if not self._quiet:
                edited()

        self.parameter.param.watch(choose, "value")
        for widget in (self.start, self.stop, self.count):
            widget.param.watch(edit, "value")

    def axis(self) -> Axis:
        """Return the axis; one of integers has all of them."""
        kind = AXES[self.name]
        start, stop = (self._number(field) for field in (self.start, self.stop))
        count = int(stop - start) + 1 if kind.whole else self.count.value
        return Axis(name=self.name, start=start, stop=stop, count=count)

    def _number(self, field: Any) -> float:
        """Return what stands in a field, in SI units."""
        kind = AXES[self.name]
        try:
            return float(f"{float(field.value) * kind.scale:.12g}")
        except ValueError:
            raise InputError(
                f"{field.label} is {field.value!r}; it must be a number, of {kind.label}."
            ) from None


def _text(value: float) -> str:
    return f"{value:.12g}"
