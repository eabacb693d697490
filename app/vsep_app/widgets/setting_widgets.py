"""Widgets of settings: one for each record, bound both ways.

A slider sets its setting when it is released. A widget never starts anything itself: whoever
watches the settings restarts the run or redraws the view.
"""

from collections.abc import Callable
from typing import Any

import panel_material_ui as pmu
import param

from vsep.parameters import Parameter
from vsep.presets.registry import DEFAULT_PRESET, PRESETS
from vsep_app.model.settings import Settings
from vsep_app.widgets.layout import number_or_nothing

TIGHT = {"sizing_mode": "stretch_width", "size": "small"}
SLIDER_MARGIN = (0, 22, 0, 18)
SELECT_MARGIN = (6, 16, 6, 16)
SWITCH_MARGIN = (0, 12, 0, 18)
EMPTY_TEXTS = {"object_threshold_db": "from the false alarms"}


def setting_widget(settings: Settings, record: Parameter) -> Any:
    """Return the widget of a setting, which it sets and shows.

    The kind follows from the record: a choice, a switch, a text that may be empty, a slider over
    a few values, a slider, or a whole number to type.
    """
    value = getattr(settings, record.name)
    if record.choices is not None:
        options = {label: name for name, label in record.choices.items()}
        widget = _made(pmu.Select, record, SELECT_MARGIN, options=options, value=value)
    elif isinstance(record.default, bool):
        widget = _made(pmu.Switch, record, SWITCH_MARGIN, value=value)
    elif record.optional:
        return _optional_number(settings, record)
    elif record.values:
        offered = sorted({*record.values, value})
        widget = _made(pmu.DiscreteSlider, record, SLIDER_MARGIN, options=offered, value=value)
        # On release the browser sends the place of the value, not the value itself, as
        # "value_throttled" (panel-material-ui 0.16.6); "value" is the value at all times.
        return _bound(settings, record, widget, "value_throttled", lambda _: widget.value)
    elif record.whole and record.span is None:
        assert record.bounds is not None
        start, end = record.bounds
        widget = _made(pmu.IntInput, record, SELECT_MARGIN, start=start, end=end, value=value)
        # The browser sets "value" once the user leaves the field; "value_throttled" never.
    else:
        widget = _slider(record, value)
        return _bound(settings, record, widget, "value_throttled")
    return _bound(settings, record, widget, "value")


def _made(kind: Any, record: Parameter, margin: tuple[int, ...], **options: Any) -> Any:
    return kind(label=record.form_label, description=record.help, margin=margin, **TIGHT, **options)


def _slider(record: Parameter, value: float) -> Any:
    ends = PRESETS[DEFAULT_PRESET].ranges().get(record.name, record.offered)
    assert ends is not None
    kind = pmu.IntSlider if record.whole else pmu.FloatSlider
    return _made(
        kind,
        record,
        SLIDER_MARGIN,
        start=min(value, ends[0]),
        end=max(value, ends[1]),
        value=value,
        step=int(record.step) if record.whole else record.step,
        **({"format": record.digits} if record.digits else {}),
    )


def _optional_number(settings: Settings, record: Parameter) -> Any:
    """Return a field that may be empty; what is no such number is marked and changes nothing."""
    name = record.name
    placeholder = EMPTY_TEXTS.get(name, "")
    field = _made(pmu.TextInput, record, SELECT_MARGIN, placeholder=placeholder)

    def take(event: Any) -> None:
        try:
            settings.param.update(**{name: number_or_nothing(event.new)})
            field.error_state = False
        except ValueError:
            field.error_state = True

    def show(*_: Any) -> None:
        value = getattr(settings, name)
        field.value = "" if value is None else repr(value)

    show()
    field.param.watch(take, "value")
    settings.param.watch(show, name)
    return field


def _bound(
    settings: Settings,
    record: Parameter,
    widget: Any,
    committed: str,
    read: Callable[[Any], Any] = lambda value: value,
) -> Any:
    """Let the widget set the setting when the user commits, and show it in any case."""
    name, declared = record.name, Settings.param[record.name]

    def take(event: Any) -> None:
        if event.new is None:
            return
        chosen = read(event.new)
        within = isinstance(declared, param.Number)
        value = declared.crop_to_bounds(chosen) if within else chosen
        settings.param.update(**{name: value})
        if value != chosen:
            widget.value = value

    def show(event: Any) -> None:
        if widget.value != event.new:
            widget.value = event.new

    widget.param.watch(take, committed)
    settings.param.watch(show, name)
    return widget
