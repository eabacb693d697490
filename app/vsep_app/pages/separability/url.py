"""Map specifications in the address of the page: reading a link, and writing one."""

from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from vsep.errors import InputError, shown
from vsep.presets.registry import DEFAULT_PRESET
from vsep.separability.axes import parse_axis, parse_value
from vsep.separability.map import LAYERS
from vsep.separability.map_spec import MapSpec
from vsep.studies.study import TrialSettings

DEFAULT_X = "slope_difference_hz_per_s=-2e12:-1e11:33"
DEFAULT_Y = "sir_db=-50:30:33"
DEFAULT_LAYER = "whole_db"
START_QUERY = {
    "scene": "simulation-2-b",
    "x": "interfered_share=0.0625:1:16",
    "y": "slope_difference_hz_per_s=-2e12:-1e11:33",
    "layer": "coherence",
}
"""Of an address that names no map: how long a burst is, and how many ramps have one, decide."""
KEYS = ("scene", "x", "y", "set", "trials", "lab_seed", "method", "layer")


def with_start(query: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the query of an address; of one that names no map, that of the first picture.

    Examples
    --------
    >>> with_start({"seed": "3"})["layer"], with_start({"trials": "0"})
    ('coherence', {'trials': '0'})
    """
    return query if query.keys() & set(KEYS) else START_QUERY


def read_map_spec(query: Mapping[str, Any]) -> tuple[MapSpec, str, list[str]]:
    """Return map and layer of a link, and one sentence if it cannot be used.

    Parameters
    ----------
    query : mapping
        Decoded query of the address; what it does not name is as usual.

    Examples
    --------
    >>> read_map_spec({"x": "snr_db=0:60:7"})[0].x.count
    7
    >>> read_map_spec({"x": "noise=0:60:7"})[2][0][:26]
    "The parameter is 'noise'; "
    """
    layer = str(query.get("layer", DEFAULT_LAYER))
    errors = []
    if layer not in LAYERS:
        errors.append(f"layer is {shown(layer)}; it must be one of {', '.join(LAYERS)}.")
        layer = DEFAULT_LAYER
    try:
        spec = _spec(query)
    except InputError as error:
        errors.append(str(error))
        spec = _spec({})
    return spec, layer, errors


def write_map_spec(spec: MapSpec, layer: str, query: Mapping[str, Any]) -> str:
    """Return the query of the page's address; what belongs to other pages stays in it."""
    others = {key: value for key, value in query.items() if key not in KEYS}
    own = {
        "scene": spec.scene,
        "x": spec.x.text,
        "y": spec.y.text,
        "set": ",".join(f"{name}={value!r}" for name, value in spec.fixed),
        "trials": str(spec.trials),
        "lab_seed": str(spec.settings.seed),
        "method": spec.method,
        "layer": layer,
    }
    return "?" + urlencode({**others, **own})


def _spec(query: Mapping[str, Any]) -> MapSpec:
    fixed = [part for part in str(query.get("set", "")).split(",") if part]
    return MapSpec(
        x=parse_axis(str(query.get("x", DEFAULT_X))),
        y=parse_axis(str(query.get("y", DEFAULT_Y))),
        scene=str(query.get("scene", DEFAULT_PRESET)),
        fixed=tuple(parse_value(part) for part in fixed),
        method=str(query.get("method", "factorised")),
        trials=_whole("trials", query.get("trials", 5)),
        settings=TrialSettings(seed=_whole("lab_seed", query.get("lab_seed", 1))),
    )


def _whole(name: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} is {shown(value)}; it must be a whole number.") from None
