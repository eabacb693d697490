"""Guard of messages: each is held against the bounds of the page that it belongs to.

A slider ends, a list has its options and a field its length in the browser only; what comes over
the connection need not come from one. The state of a page on the server holds the same bounds.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from bokeh.core.property.descriptors import PropertyDescriptor
from bokeh.document import Document
from bokeh.model import DataModel, Model
from bokeh.models import Callback, ColumnDataSource

from vsep.errors import InputError

MAX_BUFFER = 10 * 2**20
"""Bytes of one part of a file; the field for files sends it in such parts."""
MAX_TEXT = 2**20
"""Characters of all else that a message says."""
MAX_FILE = 256 * 2**20
"""Bytes of one file, of a field that has no bound of its own."""

_MAX_FIELD = 20_000
# What a component of the page keeps of its own. All else of it is for the server to say; browsers
# tell that, too, at times, such as the end that a slider has just been given.
_STATES = {
    *("value", "value_throttled", "value_input", "active", "open", "notifications"),
    *("sidebar_open", "sidebar_width", "dropdown_open", "collapsed", "expanded", "dark_theme"),
    *("filter_str", "scroll_position"),
}
_VALUES = ("value", "value_throttled", "value_input")
# Sources in which a browser says what happened there, and their longest words: a picture was drawn,
# a key or something was pressed, the pointer drags, the history goes to an address. All others are
# for the server alone.
_TOLD_SOURCES = {"drawn": 100, "pressed": 100, "dragged": 100, "went": 4000}
_OF_THE_BROWSER = ("panel.models.browser", "panel.models.location")
_OF_FIGURES = ("bokeh.models", "bokeh.plotting")
_NO_OFFER = (None, None, None)
_WIRES = ("js_property_callbacks", "js_event_callbacks", "subscribed_events", "name", "tags")


class MessageGuard:
    """The guard of one connection; it knows how far files have come."""

    def __init__(self) -> None:
        self._uploads: dict[str, Upload] = {}
        self._has_pulled = False
        # What components offer, as the browser was first told; and those for which it has changed.
        self._offers: dict[str, Any] = {}
        self._moving: set[str] = set()

    def check(self, message: Any, document: Document) -> None:
        """Leave in a message what a browser may say, written anew, and nothing else.

        Raises `InputError` if nothing of it is to be done.
        """
        if message.msgtype == "PULL-DOC-REQ" and not self._has_pulled:
            self._has_pulled = True
            states = [each for each in document.models if isinstance(each, DataModel)]
            self._offers = {each.id: _offer(each) for each in states if _offer(each) != _NO_OFFER}
            return
        if message.msgtype != "PATCH-DOC":
            raise InputError(f"A browser does not send {message.msgtype} here.")
        for number, offer in self._offers.items():
            state = document.get_model_by_id(number)
            if state is not None and _offer(state) != offer:
                self._moving.add(number)
        num_bytes = sum(len(buffer.data) for buffer in message.buffers)
        try:
            events = [self._clean(each, document, num_bytes) for each in message.content["events"]]
        except InputError:
            raise
        except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
            raise InputError("The message cannot be read.") from None
        message.content = {"events": [each for each in events if each is not None]}

    def _clean(self, event: Any, document: Document, num_bytes: int) -> Any:
        """Return an event with all that it may say; None if it is not to be done."""
        kind = event["kind"]
        if kind == "MessageSent" and event["msg_type"] == "bokeh_event":
            told = self._clean_event(event["msg_data"], document, num_bytes)
            sent = {"kind": kind, "msg_type": "bokeh_event", "msg_data": told}
            return None if told is None else sent
        if kind != "ModelChanged":
            raise InputError(f"A browser does not send {kind} here.")
        model = document.get_model_by_id(event["model"]["id"])
        name, new = event["attr"], event["new"]
        # What has just left the page may still be on its way.
        if model is None:
            return None
        try:
            is_allowed = is_allowed_change(model, name, new)
        except InputError:
            # So may what a component no longer offers, which is no fault of the browser.
            if name not in _VALUES or model.id not in self._moving:
                raise
            return None
        if not is_allowed:
            return None
        return {"kind": kind, "model": {"id": model.id}, "attr": name, "new": new}

    def _clean_event(self, event: Any, document: Document, num_bytes: int) -> Any:
        values = _entries(event["values"])
        named = values.pop("model", None)
        model = None if named is None else document.get_model_by_id(named["id"])
        if named is not None and model is None:
            return None
        state, buffer = getattr(model, "data", None), {}
        if event["name"] == "data_event" and isinstance(state, DataModel):
            told = _entries(values["data"])
            if hasattr(state, "max_file_size"):
                buffer = {"data": _of_a_buffer(told.pop("data"))} if "data" in told else {}
                upload = self._uploads.setdefault(state.id, Upload(_most_bytes(state)))
                upload.take(told, num_bytes)
            elif hasattr(state, "items") and "item" in told:
                _require_item(state.items, told["item"])
            values["data"] = _map(told)
        _require_plain(list(values.values()))
        if buffer:
            values["data"] = _map({**told, **buffer})
        if model is not None:
            values = {"model": {"id": model.id}, **values}
        if getattr(state, "disabled", False):
            return None
        return {"type": "event", "name": str(event["name"]), "values": _map(values)}


class Upload:
    """The parts of files that have come to one field, which come one after the other.

    Parameters
    ----------
    most_bytes : int
        Of all files together, until the field has taken them.
    """

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        # Of files that are whole, of the one that is coming, and of those that never came whole:
        # these stay on the server as long as the page.
        self._whole = self._coming = self._left = 0
        self._file: tuple[Any, Any] | None = None
        self._part = 0

    def take(self, told: Mapping[str, Any], num_bytes: int) -> None:
        """Count what is told of a part. Raises `InputError` if it is no next one, or too much."""
        if told.get("status") == "finished":
            self._whole = 0
        if told.get("status") != "upload_event":
            return
        file, part = (told.get("name"), told.get("total_chunks")), told.get("chunk")
        goes_on = file == self._file
        if not isinstance(file[0], str) or part != (self._part + 1 if goes_on else 1):
            raise InputError("The parts of a file come one after the other.")
        if not goes_on:
            self._left, self._coming = self._left + self._coming, 0
        self._coming += num_bytes
        if self._whole + self._coming + self._left > self._most_bytes:
            raise InputError(
                f"The files have more than {self._most_bytes // 2**20} MB, which is all that is "
                "taken."
            )
        self._file, self._part = file, part
        if part == file[1]:
            self._whole, self._coming = self._whole + self._coming, 0
            self._file, self._part = None, 0


def is_allowed_change(model: Model, name: str, new: Any) -> bool:
    """Whether a browser's change of a model is done.

    That of what a component offers is not, nor that of a component that has just been disabled.

    Raises `InputError` if the change is for the server alone, or the value out of bounds.
    """
    where = type(model).__module__
    is_state = isinstance(model, DataModel)
    if is_state and name not in _STATES:
        return False
    if is_state:
        _require_no_file(model, name)
    elif isinstance(model, ColumnDataSource) and name == "data":
        _require_like(model, new)
    elif name != "scroll_position" and (
        isinstance(model, Callback)
        or name in _WIRES
        or not where.startswith((*_OF_THE_BROWSER, *_OF_FIGURES))
    ):
        raise InputError(f"{name} of {_kind(model)} is for the server to say.")
    if name == "notifications":
        return _are_references(new)
    _require_plain(new)
    new = _number(new)
    if is_state or not isinstance(new, dict):
        _require_valid(model, name, new)
    if is_state and name in _VALUES:
        _require_bounds(model, name, new)
        return not getattr(model, "disabled", False)
    return True


def _require_no_file(model: Model, name: str) -> None:
    """Refuse files that do not come in parts."""
    if name in _VALUES and hasattr(model, "max_file_size"):
        raise InputError(f"{name} of {_kind(model)} is for the server to say.")


def _require_like(source: ColumnDataSource, new: Any) -> None:
    """Refuse columns that are others, or longer, than those of the server, and long words."""
    if source.name not in _TOLD_SOURCES:
        raise InputError("The data of a figure are for the server to say.")
    columns, data = _entries(new), source.data
    if columns.keys() != data.keys() or any(
        not isinstance(column, list) or len(column) != len(data[name])
        for name, column in columns.items()
    ):
        raise InputError("A source keeps its columns and their length.")
    most = _TOLD_SOURCES[source.name]
    if any(isinstance(each, str) and len(each) > most for c in columns.values() for each in c):
        raise InputError(f"A word of this source has at most {most} characters.")


def _require_valid(model: Model, name: str, new: Any) -> None:
    try:
        descriptor = model.lookup(name)
    except AttributeError:
        raise InputError(f"{_kind(model)} has no {name}.") from None
    if isinstance(descriptor, PropertyDescriptor) and not descriptor.property.is_valid(new):
        raise InputError(f"{name} of {_kind(model)} cannot be {_shown(new)}.")


def _require_bounds(model: Model, name: str, new: Any) -> None:
    """Refuse a value of a component that it does not offer."""
    options, length = getattr(model, "options", None), getattr(model, "max_length", None)
    start, end = getattr(model, "start", None), getattr(model, "end", None)
    if isinstance(new, list) != isinstance(model.value, list | tuple):
        raise InputError(f"{name} of {_kind(model)} cannot be {_shown(new)}.")
    for value in new if isinstance(new, list) else [new]:
        if isinstance(value, str) and len(value) > (length or _MAX_FIELD):
            raise InputError(
                f"{_kind(model)} has {len(value)} characters; it takes {length or _MAX_FIELD}."
            )
        if options is not None:
            offered = list(_leaves(options))
            is_place = isinstance(value, int) and 0 <= value < len(offered)
            if not (value is None or value in offered or (start is not None and is_place)):
                raise InputError(f"{name} of {_kind(model)} does not offer {_shown(value)}.")
        elif isinstance(value, int | float) and not _lies(value, start, end):
            raise InputError(
                f"{name} of {_kind(model)} is {_shown(value)}; it must lie between {start} and "
                f"{end}."
            )


def _lies(value: float, start: Any, end: Any) -> bool:
    """Whether a number lies between two ends; None, and what is no number, is no end."""
    lower = start if isinstance(start, int | float) else -math.inf
    upper = end if isinstance(end, int | float) else math.inf
    # A text of a thousand digits makes a whole number that is larger than all others.
    return lower <= value <= upper and (isinstance(value, int) or math.isfinite(value))


def _require_item(items: Any, place: Any) -> None:
    """Refuse a place that no item of a menu has."""
    for number in place if isinstance(place, list) else [place]:
        if not isinstance(number, int) or not 0 <= number < len(items):
            raise InputError(f"The menu has no item {_shown(place)}.")
        held = items[number]
        items = held.get("items", ()) if isinstance(held, dict) else ()


def _require_plain(value: Any) -> None:
    """Refuse all but numbers, texts, lists and maps of these.

    Bokeh would make models that a message describes, and unpack what is packed in it.
    """
    if isinstance(value, list):
        for each in value:
            _require_plain(each)
    elif isinstance(value, dict):
        kind = value.get("type")
        if kind == "map":
            for pair in value.get("entries", []):
                _require_plain(pair)
        elif kind != "number":
            raise InputError(f"A browser does not send a value of type {_shown(kind)} here.")


def _are_references(value: Any) -> bool:
    """Whether a list holds objects that are there; one that has just gone a browser describes."""
    return isinstance(value, list) and all(
        isinstance(each, dict) and set(each) == {"id"} and isinstance(each["id"], str)
        for each in value
    )


def _of_a_buffer(value: Any) -> dict[str, Any]:
    """Return bytes that came as they are, behind the text of the message."""
    return {"type": "bytes", "data": {"id": str(value["data"]["id"])}}


def _map(values: dict[str, Any]) -> dict[str, Any]:
    """Return a map as Bokeh writes it."""
    return {"type": "map", "entries": [list(each) for each in values.items()]}


def _entries(value: Any) -> dict[str, Any]:
    """Return what is in a map as Bokeh writes it."""
    if not isinstance(value, dict) or value.get("type") != "map":
        raise InputError("A map is needed here.")
    return dict(value.get("entries", []))


def _number(value: Any) -> Any:
    """Return a number that JSON cannot write; all else as it is."""
    is_odd = isinstance(value, dict) and value.get("type") == "number"
    return float(value["value"]) if is_odd else value


def _leaves(options: Any) -> Iterator[Any]:
    """Return all that can be chosen, without the names of groups."""
    values = options.values() if isinstance(options, dict) else options
    for each in values:
        if isinstance(each, list | tuple | dict):
            yield from _leaves(each)
        else:
            yield each


def _offer(state: Any) -> tuple[Any, ...]:
    """Return what a component offers: two ends, or options."""
    options = getattr(state, "options", None)
    kept = list(options) if isinstance(options, list | tuple) else options
    return getattr(state, "start", None), getattr(state, "end", None), kept


def _most_bytes(state: Any) -> int:
    """Return the bound of all files together: of two, unless the field has one of its own."""
    at_once = 2 if getattr(state, "multiple", False) else 1
    return int(state.max_total_file_size or at_once * (state.max_file_size or MAX_FILE))


def _kind(model: Model) -> str:
    """Return what a component is called on the page, or what it is."""
    return str(getattr(model, "label", None) or type(model).__name__.rstrip("0123456789"))


def _shown(value: Any) -> str:
    return f"{value!r:.60}"
