"""Rows on disk: one line of JSON each, appended as they finish, read again to resume.

A process that is killed while it writes leaves a torn last line, and a machine that loses its power
may leave zeros in the place of the last rows. What stands behind the last whole row is left out,
cut off before more rows are written, and the rows are made anew.
"""

import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, TypeAlias

from vsep.errors import InputError
from vsep.files.opening import read_bounded
from vsep.files.results import as_json
from vsep.studies.catalogue import make_study, require_study
from vsep.studies.study import Study, Trial, TrialSettings, point_of
from vsep.studies.trial import DONE, FAILED, Row

RowKey: TypeAlias = tuple[str, int, int, str]

_FIRST_KEY = b'{"study": '
# What every row has, and what a finished one has besides; a number may be null, which is NaN.
_NUMBER = (int, float)
_MAX_INTEGER = 2**63
_MAX_NUMBER = 1e150  # the square is still a number
_HEAD: dict[str, type | tuple[type, ...]] = {
    **dict.fromkeys(("study", "method", "status", "schedule"), str),
    **dict.fromkeys(("point_index", "realization", "seed"), int),
    **dict.fromkeys(("gospa_cutoff", "gospa_order"), _NUMBER),
    "point": dict,
}
_RESULTS: dict[str, type | tuple[type, ...]] = {
    **dict.fromkeys(("num_objects_true", "num_objects", "num_ramps", "num_samples"), int),
    **dict.fromkeys(("misses", "false_alarms", "iterations", "seconds"), (*_NUMBER, type(None))),
    "termination": str,
}
_TEXTS = {"study", "method", "status", "schedule", "termination", "reason", "version", "preset"}
_POINT_TEXTS = {"panel", "scene", "interference_model"}
_POINT_TEXTS |= {"prior", "prior_source", "threshold", "mask", "domain"}
_LISTS = ("errors", "beat_errors", "beat_stds")
_LISTS_OF_SEVERAL_RAMPS = ("doppler_errors", "doppler_stds")


def row_key(row: Row) -> RowKey:
    """Return what identifies a row: study, point, realisation and method."""
    return row["study"], row["point_index"], row["realization"], row["method"]


def trial_of_row(row: Row) -> Trial:
    """Return the trial that made a row, with the row's method alone: run it to see it again."""
    return Trial(
        study=row["study"],
        point_index=row["point_index"],
        point=point_of(row["point"]),
        realization=row["realization"],
        methods=(row["method"],),
        settings=TrialSettings(**{field.name: row[field.name] for field in fields(TrialSettings)}),
    )


def rows_text(rows: Iterable[Row]) -> str:
    """Return the lines of rows."""
    return "".join(as_json(row) + "\n" for row in rows)


def read_rows(path: str | Path) -> list[Row]:
    """Read all whole rows of a file; a torn last line is left out, repeated rows are kept once.

    Raises
    ------
    InputError
        If a line is no row of a study.
    OSError
        If the file cannot be read.
    """
    content = read_bounded(path, str(path), "a file of rows")
    whole = content[: _whole_bytes(path, content)]
    rows = [_parse(path, number, line) for number, line in enumerate(whole.splitlines(), 1)]
    return list({row_key(row): row for row in rows}.values())


def torn_bytes(path: str | Path) -> int:
    """Return how many bytes stand behind the last whole row of a file; 0 where there is none.

    Raises
    ------
    InputError
        If these are not what an interrupted write leaves.
    """
    if not os.path.exists(path):
        return 0
    content = read_bounded(path, str(path), "a file of rows")
    return len(content) - _whole_bytes(path, content)


def study_of_rows(rows: Sequence[Row], path: str | Path) -> Study:
    """Return the study that the first row belongs to, as far as its rows go.

    Parameters
    ----------
    rows : sequence of dict
        Those of other studies are passed over.
    path : str or Path
        Where they are from, for the message.

    Returns
    -------
    Study
        With the points, methods and realisations that have rows.

    Raises
    ------
    InputError
        If there is no row, or they are not of one study of the catalogue with one set of settings.
    """
    if not rows:
        raise InputError(f"{path} holds no rows; run a study into it first.")
    first = rows[0]
    own = [row for row in rows if row["study"] == first["study"]]
    trial = trial_of_row(first)
    catalogued = require_study(trial.study)
    changes: dict[str, Any] = {}
    if trial.point_index < len(catalogued.points):
        usual = catalogued.points[trial.point_index].parameters()
        found = trial.point.parameters()
        changes = {
            name: found[name] for name in catalogued.changeable if found[name] != usual[name]
        }
    study = make_study(
        trial.study,
        realizations=1 + max(row["realization"] for row in own),
        settings=trial.settings,
        changes=changes,
    )
    require_same_study(own, study, path)
    # By name alone: a method that was handed over is not known here.
    methods = tuple(dict.fromkeys(row["method"] for row in own))
    selected = tuple(sorted({row["point_index"] for row in own}))
    return replace(study, methods=methods, selected=selected)


def require_same_study(rows: Iterable[Row], study: Study, path: str | Path) -> None:
    """Refuse to mix rows of other settings into one file: a figure would average over both.

    Raises `InputError` if a row of this study has another seed, schedule, GOSPA or point.
    """
    expected = asdict(study.settings)
    for row in rows:
        if row["study"] != study.name:
            continue
        for name, value in expected.items():
            if row.get(name) != value:
                raise InputError(
                    f"{path} holds rows of {name} {row.get(name)}; it is {value} now: give another "
                    "file or the same settings."
                )
        index = row["point_index"]
        # As points: a row of an older version has no entry for what a point has got since.
        if index >= len(study.points) or point_of(row["point"]) != study.points[index]:
            raise InputError(
                f"{path} holds rows of another point {index} of {study.name}; give another file."
            )


def _whole_bytes(path: str | Path, content: bytes) -> int:
    """Return where the last whole row ends, before the first zero byte if there is one."""
    written, _, behind = content.partition(b"\0")
    length = written.rfind(b"\n") + 1
    tail = written[length:]
    is_torn = tail.startswith(_FIRST_KEY) or _FIRST_KEY.startswith(tail)
    # What begins with zeros and goes on with something else never was a file of rows.
    if not is_torn or (length == 0 and behind.strip(b"\0")):
        raise InputError(f"The last line of {path} is no row of a study; give another file.")
    return length


def _parse(path: str | Path, number: int, line: bytes) -> Row:
    try:
        row = json.loads(line)
        whole = isinstance(row, dict) and _is_whole(row)
    except (ValueError, RecursionError):
        whole = False
    if not whole:
        raise InputError(f"Line {number} of {path} is no row of a study; give another file.")
    return dict(row)


def _is_whole(row: dict[str, Any]) -> bool:
    """Whether a row has all that a figure is made of, and every entry is of its kind."""
    plain = all(_is_of_kind(name, value) for name, value in row.items() if name != "point")
    return plain and _has_head(row) and (row["status"] == FAILED or _has_results(row))


def _is_of_kind(name: str, value: Any) -> bool:
    """Whether an entry is what its name says: a text, a list of numbers, or a number."""
    if value is None:
        return True
    if name in _TEXTS:
        return isinstance(value, str)
    if isinstance(value, list):
        return name.endswith(("errors", "stds", "assigned")) and all(map(_is_number, value))
    return _is_number(value)


def _is_number(value: Any) -> bool:
    """Whether a value is null or a number that a figure can be made of."""
    if isinstance(value, int):
        return abs(value) < _MAX_INTEGER
    return value is None or (isinstance(value, float) and abs(value) < _MAX_NUMBER)


def _has_head(row: dict[str, Any]) -> bool:
    if not _has(row, _HEAD) or row["status"] not in (DONE, FAILED):
        return False
    if min(row["point_index"], row["realization"]) < 0:
        return False
    entries = row["point"].items()
    if not all(isinstance(value, str) or _is_number(value) for _, value in entries):
        return False
    if any(isinstance(value, str) != (name in _POINT_TEXTS) for name, value in entries):
        return False
    try:
        point = trial_of_row(row).point
    except (InputError, TypeError):
        return False
    rate = point.false_alarm_rate
    numbers = isinstance(point.snr_db, _NUMBER) and isinstance(point.sir_db, _NUMBER)
    return numbers and (rate is None or rate > 0.0)


def _has_results(row: dict[str, Any]) -> bool:
    several = row.get("num_ramps", 1) != 1
    lists = (*_LISTS, *_LISTS_OF_SEVERAL_RAMPS) if several else _LISTS
    if not (_has(row, _RESULTS) and _has(row, dict.fromkeys(lists, list))):
        return False
    # A standard deviation may be infinite, which is null; an error is of an object that was found.
    if any(None in row[name] for name in lists if name.endswith("errors")):
        return False
    return len({len(row[name]) for name in lists[1:]}) == 1


def _has(row: dict[str, Any], types: dict[str, Any]) -> bool:
    return all(name in row and isinstance(row[name], kind) for name, kind in types.items())
