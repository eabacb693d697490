"""A trial of a separability map as one word of an address, and back.

The word is ``separability-map/scene/method/seed/schedule/realization/values``; the values are those
of the point that are not its usual ones, ``name=value`` joined by commas, so that a browser can put
a word together from the values of two axes.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from vsep.errors import InputError, shown
from vsep.presets.registry import PRESET_NAMES
from vsep.separability.map_spec import MAP_STUDY, MapSpec
from vsep.studies.study import Point, Trial, TrialSettings

_HEAD = ("panel", "scene")
_INDEX = re.compile(r"[0-9]{1,19}")
_WHOLE = ("num_objects", "num_interfered_ramps", "butterworth_order", "num_interferers")
_POINT_NAMES = {
    "slope_difference_hz_per_s": "interferer_slope_hz_per_s",
    "interfered_share": "num_interfered_ramps",
}
_FORM = "separability-map/scene/method/seed/schedule/realization/name=value,..."
_DEFAULTS = {field.name: field.default for field in fields(Point)}


def is_map_trial_word(word: str) -> bool:
    """Whether a word names a trial of a separability map."""
    return word.startswith(f"{MAP_STUDY}/")


def trial_word(trial: Trial) -> str:
    """Return the word of a trial with one method."""
    values = ",".join(_values(trial.point.parameters()))
    settings = trial.settings
    head = (MAP_STUDY, trial.point.scene, trial.methods[0], settings.seed, settings.schedule)
    return "/".join(map(str, (*head, trial.realization, values)))


def word_parts(spec: MapSpec) -> tuple[str, list[str], list[str]]:
    """Return what the words of all cells are put together from.

    Parameters
    ----------
    spec : MapSpec
        The map; its first realisation is meant.

    Returns
    -------
    start : str
        What all words begin with.
    x_parts, y_parts : list of str
        What comes then for each column, and after a comma for each row.

    Examples
    --------
    >>> from vsep.separability.axes import parse_axis
    >>> maps = MapSpec(x=parse_axis("sir_db=-40:40:33"), y=parse_axis("snr_db=0:60:31"))
    >>> start, columns, rows = word_parts(maps)
    >>> trial_of_word(start + columns[32] + "," + rows[0]) == maps.trial((32, 0))
    True
    """
    x_name, y_name = (_POINT_NAMES.get(axis.name, axis.name) for axis in (spec.x, spec.y))
    point = spec.point((0, 0)).parameters()
    others = _values({key: value for key, value in point.items() if key not in (x_name, y_name)})
    trial = spec.trial((0, 0))
    settings = trial.settings
    head = (MAP_STUDY, spec.scene, spec.method, settings.seed, settings.schedule, 0, "")
    start = "/".join(map(str, head)) + "".join(f"{value}," for value in others)
    columns = [spec.point((column, 0)).parameters() for column in range(spec.x.count)]
    rows = [spec.point((0, row)).parameters() for row in range(spec.y.count)]
    return (
        start,
        [f"{x_name}={json.dumps(values[x_name])}" for values in columns],
        [f"{y_name}={json.dumps(values[y_name])}" for values in rows],
    )


def trial_of_word(word: str) -> Trial:
    """Return the trial that a word names.

    Raises `InputError` if it names none.

    Examples
    --------
    >>> word = "separability-map/simulation-1/joint/1/robust/3/snr_db=30,sir_db=-5"
    >>> trial_of_word(word).point.sir_db
    -5.0
    """
    parts = word.split("/")
    if len(parts) != 7 or parts[0] != MAP_STUDY or parts[1] not in PRESET_NAMES:
        raise InputError(f"trial is {shown(word)}; it must read {_FORM}.")
    _, scene, method, seed, schedule, realization, values = parts
    if not (_INDEX.fullmatch(seed) and _INDEX.fullmatch(realization)):
        raise InputError(f"trial is {shown(word)}; seed and realization must be whole numbers.")
    entries = dict(_entry(word, part) for part in values.split(","))
    try:
        point = Point(panel=MAP_STUDY, scene=scene, **entries)
    except TypeError:
        raise InputError(f"trial is {shown(word)}; it must name snr_db and sir_db.") from None
    return Trial(
        study=MAP_STUDY,
        point_index=0,
        point=point,
        realization=int(realization),
        methods=(method,),
        settings=TrialSettings(seed=int(seed), schedule=schedule),
    )


def _values(parameters: Mapping[str, Any]) -> list[str]:
    """Return the values of a point that are not its usual ones."""
    return [
        f"{name}={json.dumps(value)}"
        for name, value in parameters.items()
        if name not in _HEAD and value != _DEFAULTS[name]
    ]


def _entry(word: str, part: str) -> tuple[str, Any]:
    """Read one value of the point."""
    name, _, text = part.partition("=")
    if name not in _DEFAULTS or name in _HEAD:
        raise InputError(f"trial is {shown(word)}; {shown(name)} is no parameter of a point.")
    if name == "interference_model":
        return name, text.strip('"')
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"trial is {shown(word)}; {name} must be a number.") from None
    if name not in _WHOLE:
        return name, value
    if not value.is_integer():
        raise InputError(f"trial is {shown(word)}; {name} must be a whole number.")
    return name, int(value)
