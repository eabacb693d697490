"""A question in the address of the page: reading a link, and writing one."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from vsep._arrays import InputError
from vsep.laboratory.atlas import LAYERS
from vsep.laboratory.axes import parse_axis, parse_value
from vsep.laboratory.question import Question
from vsep.studies.study import TrialSettings

DEFAULT_X = "slope_difference_hz_per_s=-2e12:-1e11:33"
DEFAULT_Y = "sir_db=-50:30:33"
DEFAULT_LAYER = "whole_db"
KEYS = ("scene", "x", "y", "set", "trials", "lab_seed", "method", "layer")


def read_question(query: Mapping[str, Any]) -> tuple[Question, str, list[str]]:
    """Return question and layer of a link, and one sentence if it cannot be used.

    Parameters
    ----------
    query : mapping
        Decoded query of the address; what it does not name is as usual.

    Examples
    --------
    >>> read_question({"x": "snr_db=0:60:7"})[0].x.count
    7
    >>> read_question({"x": "noise=0:60:7"})[2][0][:26]
    "The parameter is 'noise'; "
    """
    layer = str(query.get("layer", DEFAULT_LAYER))
    complaints = []
    if layer not in LAYERS:
        complaints.append(f"layer is {layer!r}; it must be one of {', '.join(LAYERS)}.")
        layer = DEFAULT_LAYER
    try:
        question = _question(query)
    except InputError as error:
        complaints.append(str(error))
        question = _question({})
    return question, layer, complaints


def write_question(question: Question, layer: str, query: Mapping[str, Any]) -> str:
    """Return the query of the page's address; what belongs to other pages stays in it."""
    others = {key: value for key, value in query.items() if key not in KEYS}
    own = {
        "scene": question.scene,
        "x": question.x.text,
        "y": question.y.text,
        "set": ",".join(f"{name}={value!r}" for name, value in question.fixed),
        "trials": str(question.trials),
        "lab_seed": str(question.settings.seed),
        "method": question.method,
        "layer": layer,
    }
    return "?" + urlencode({**others, **own})


def _question(query: Mapping[str, Any]) -> Question:
    fixed = [part for part in str(query.get("set", "")).split(",") if part]
    return Question(
        x=parse_axis(str(query.get("x", DEFAULT_X))),
        y=parse_axis(str(query.get("y", DEFAULT_Y))),
        scene=str(query.get("scene", "simulation-1")),
        fixed=tuple(parse_value(part) for part in fixed),
        method=str(query.get("method", "factorised")),
        trials=_whole("trials", query.get("trials", 5)),
        settings=TrialSettings(seed=_whole("lab_seed", query.get("lab_seed", 1))),
    )


def _whole(name: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}; it must be a whole number.") from None
