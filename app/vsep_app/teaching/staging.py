"""Staging of an experiment: what to predict, and which part of the page is shown how."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from vsep.errors import InputError, shown
from vsep_app.model.score import Score
from vsep_app.model.url import QUERY_NAMES

VIEWS = ("chirps", "fast_time", "delay", "maps", "tables")
"""Views of the live page."""
HIDDEN_PARTS = (*VIEWS, "toolbar")
"""Parts of the live page that an experiment may hide, beside the controls of settings."""
STAGING_KEYS = ("predict", "show", "lock", "hide", "zoom")
_MOST_PREDICTIONS = 5
_NUMBERS = ("found", "false")
_ZOOMS = ("range", "velocity", "arrow")

Span = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Prediction:
    """One of several outcomes to choose from before the run."""

    text: str  #: As it is offered.
    #: Least and largest number of true objects found and of false ones; None: any.
    found: Span | None = None
    false: Span | None = None

    def holds(self, score: Score) -> bool:
        """Whether a run has ended so."""
        told = ((self.found, score.num_found), (self.false, score.num_false))
        return all(span is None or span[0] <= number <= span[1] for span, number in told)


@dataclass(frozen=True, kw_only=True)
class Zoom:
    """The part of the map that is shown, and what an arrow points at."""

    #: Ends of both axes, in m and m/s; None: all.
    range: Span | None = None
    velocity: Span | None = None
    arrow: Span | None = None  #: Range and velocity of what it points at; None: no arrow.
    label: str = ""  #: Its name.


@dataclass(frozen=True, kw_only=True)
class Staging:
    """What an experiment does beside setting controls."""

    predictions: tuple[Prediction, ...] = ()
    #: Settings whose controls stand in the experiment itself, and those that cannot be moved.
    show: tuple[str, ...] = ()
    lock: tuple[str, ...] = ()
    hide: tuple[str, ...] = ()  #: Of `HIDDEN_PARTS`, and settings.
    zoom: Zoom | None = None


def read_staging(content: Mapping[str, Any]) -> Staging:
    """Return the staging of the content of a file.

    Raises `InputError` where a value is not what it must be.
    """
    settings = {key: name for name, key in QUERY_NAMES.items()}
    return Staging(
        predictions=_predictions(content.get("predict", [])),
        show=tuple(settings[key] for key in _words(content, "show", settings)),
        lock=tuple(settings[key] for key in _words(content, "lock", settings)),
        hide=tuple(
            settings.get(word, word) for word in _words(content, "hide", (*HIDDEN_PARTS, *settings))
        ),
        zoom=_zoom(content["zoom"]) if "zoom" in content else None,
    )


def _words(content: Mapping[str, Any], key: str, allowed: Any) -> tuple[str, ...]:
    words = content.get(key, [])
    if not isinstance(words, list):
        raise InputError(f"its {key} is {shown(words)}; it must be a list of words.")
    for word in words:
        if not isinstance(word, str) or word not in allowed:
            raise InputError(f"its {key} has {shown(word)}; it may have {', '.join(allowed)}.")
    return tuple(words)


def _predictions(entries: Any) -> tuple[Prediction, ...]:
    if not isinstance(entries, list) or not all(isinstance(each, Mapping) for each in entries):
        raise InputError("its predict is no list of tables; begin each with a line [[predict]].")
    if entries and not 2 <= len(entries) <= _MOST_PREDICTIONS:
        raise InputError(
            f"it has {len(entries)} predictions; it may have 2 to {_MOST_PREDICTIONS}, or none."
        )
    return tuple(_prediction(each) for each in entries)


def _prediction(entry: Mapping[str, Any]) -> Prediction:
    unknown = [key for key in entry if key not in ("text", *_NUMBERS)]
    if unknown:
        allowed = ", ".join(("text", *_NUMBERS))
        raise InputError(f"a prediction has {shown(unknown[0])}; it may have {allowed}.")
    text = entry.get("text")
    if not isinstance(text, str) or not text.strip():
        raise InputError("a prediction has no text.")
    spans = {key: _count(key, entry[key]) for key in _NUMBERS if key in entry}
    if not spans:
        raise InputError("a prediction says neither found nor false, so that nobody can judge it.")
    return Prediction(text=text.strip(), **spans)


def _count(key: str, value: Any) -> Span:
    ends = value if isinstance(value, list) else [value, value]
    whole = all(isinstance(end, int) and not isinstance(end, bool) for end in ends)
    if not whole or len(ends) != 2 or not 0 <= ends[0] <= ends[1]:
        raise InputError(
            f"{key} of a prediction is {shown(value)}; it must be a whole number of at least 0, "
            "or two, the smaller one first."
        )
    return ends[0], ends[1]


def _zoom(entry: Any) -> Zoom:
    if not isinstance(entry, Mapping):
        raise InputError("its zoom is no table; write it below a line [zoom].")
    unknown = [key for key in entry if key not in (*_ZOOMS, "label")]
    if unknown:
        raise InputError(
            f"its zoom has {shown(unknown[0])}; it may have {', '.join((*_ZOOMS, 'label'))}."
        )
    label = entry.get("label", "")
    if not isinstance(label, str):
        raise InputError(f"label of its zoom is {shown(label)}; it must be a text.")
    pairs = {key: _pair(key, entry[key]) for key in _ZOOMS if key in entry}
    for key in ("range", "velocity"):
        if key in pairs and not pairs[key][0] < pairs[key][1]:
            raise InputError(f"{key} of its zoom is {shown(entry[key])}; the smaller end is first.")
    return Zoom(**pairs, label=label)


def _pair(key: str, value: Any) -> Span:
    numbers: Sequence[Any] = value if isinstance(value, list) else ()
    good = all(isinstance(each, int | float) and abs(each) < 1e6 for each in numbers)
    if len(numbers) != 2 or not good:
        raise InputError(f"{key} of its zoom is {shown(value)}; it must be two numbers.")
    return float(numbers[0]), float(numbers[1])
