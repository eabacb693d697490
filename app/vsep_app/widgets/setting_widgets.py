"""Widgets of settings: one for each record, bound both ways.

A slider sets its setting when it is released. A widget never starts anything itself: whoever
watches the settings restarts the run or redraws the view.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import panel_material_ui as pmu
import param

from vsep.parameters.record import Parameter
from vsep.presets.registry import DEFAULT_PRESET, PRESETS
from vsep_app.model.settings import Settings
from vsep_app.widgets.fields import field
from vsep_app.widgets.layout import number_or_nothing

EMPTY_TEXTS = {"object_threshold_db": "from the false alarms"}


# A program that moves a slider, as a drag in a picture does, has not let it go; since Panel 1.10
# (pull request 8712) it would be taken for that.
for _movable in (pmu.FloatSlider, pmu.IntSlider):
    _movable._auto_sync_value_throttled = False


class SettingWidgets(Mapping[str, Any]):
    """Widgets of settings by the names of these, each made when it is asked for.

    Parameters
    ----------
    settings : Settings
        What they set and show.
    records : iterable of Parameter
        Which settings; a widget that is not made like others is added with `put`.
    """

    def __init__(self, settings: Settings, records: Iterable[Parameter]) -> None:
        self._settings = settings
        self._records: dict[str, Parameter | None] = {each.name: each for each in records}
        #: Those that are there so far.
        self.made: dict[str, Any] = {}
        #: Told the name of each that is made, if somebody listens.
        self.was_made: Callable[[str], None] | None = None

    def put(self, name: str, widget: Any) -> None:
        """Add a widget that is there already."""
        self._records[name], self.made[name] = None, widget

    def __getitem__(self, name: str) -> Any:
        """Return a widget, which is made if it has to be."""
        if name not in self.made:
            record = self._records[name]
            assert record is not None
            self.made[name] = setting_widget(self._settings, record)
            if self.was_made is not None:
                self.was_made(name)
        return self.made[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of all."""
        return iter(self._records)

    def __len__(self) -> int:
        """Return how many there are, made or not."""
        return len(self._records)


def setting_widget(settings: Settings, record: Parameter) -> Any:
    """Return the widget of a setting, which it sets and shows.

    The kind follows from the record: a choice, a switch, a text that may be empty, a slider over
    a few values, a slider, or a whole number to type.
    """
    value = getattr(settings, record.name)
    if record.choices is not None:
        options = {label: name for name, label in record.choices.items()}
        widget = _made(pmu.Select, record, options=options, value=value)
    elif isinstance(record.default, bool):
        widget = _made(pmu.Switch, record, value=value)
    elif isinstance(record.default, str):
        return _text(settings, record)
    elif record.optional:
        return _optional_number(settings, record)
    elif record.values:
        offered = sorted({*record.values, value})
        widget = _made(pmu.DiscreteSlider, record, options=offered, value=value)
        # On release the browser sends the place of the value, not the value itself, as
        # "value_throttled" (panel-material-ui 0.16.6); "value" is the value at all times.
        return _bound(settings, record, widget, "value_throttled", lambda _: widget.value)
    elif record.typed:
        start, end = record.offered
        widget = _made(pmu.IntInput, record, start=start, end=end, value=value)
        # The browser sets "value" once the user leaves the field; "value_throttled" never.
    else:
        widget = _slider(record, value)
        return _bound(settings, record, widget, "value_throttled")
    return _bound(settings, record, widget, "value")


def _made(kind: Any, record: Parameter, **options: Any) -> Any:
    return field(kind, record.form_label, record.help, **options)


def _slider(record: Parameter, value: float) -> Any:
    ends = PRESETS[DEFAULT_PRESET].ranges().get(record.name, record.offered)
    kind = pmu.IntSlider if record.whole else pmu.FloatSlider
    return _made(
        kind,
        record,
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
    text = _made(pmu.TextInput, record, placeholder=placeholder)

    def take(event: Any) -> None:
        try:
            settings.param.update(**{name: number_or_nothing(event.new)})
            text.param.update(error_state=False, label=record.form_label)
        except ValueError:
            lowest, highest = Settings.param[name].bounds
            allowed = f"{record.title}: {lowest:g} to {highest:g}, or empty"
            text.param.update(error_state=True, label=allowed)

    def show(*_: Any) -> None:
        value = getattr(settings, name)
        text.value = "" if value is None else repr(value)

    show()
    text.param.watch(take, "value")
    settings.param.watch(show, name)
    return text


def _text(settings: Settings, record: Parameter) -> Any:
    """Return a field for a text; one that cannot be used is marked, told and changes nothing."""
    name = record.name
    text = _made(pmu.TextInput, record, value=getattr(settings, name))

    def take(event: Any) -> None:
        try:
            settings.param.update(**{name: event.new})
            text.param.update(error_state=False, label=record.form_label)
        except ValueError as error:
            text.param.update(error_state=True, label=f"{record.title}: {error}")

    text.param.watch(take, "value")
    settings.param.watch(lambda event: text.param.update(value=event.new), name)
    return text


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
        if committed != "value":
            # The browser reports changes only: the value committed last can be set again.
            with param.edit_constant(widget):
                widget.param.update(**{committed: event.new})

    widget.param.watch(take, committed)
    settings.param.watch(show, name)
    return widget
