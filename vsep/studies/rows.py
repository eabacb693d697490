"""Rows on disk: one line of JSON each, appended as they finish, read again to resume.

A process that is killed while it writes leaves a torn last line; `repair` removes it, and the row
is made anew.
"""

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TextIO, TypeAlias

from vsep._arrays import InputError
from vsep.files.results import as_json
from vsep.studies.study import Point, Study, Trial, TrialSettings
from vsep.studies.trial import Row

RowKey: TypeAlias = tuple[str, int, int, str]

_FIRST_KEY = b'{"study": '
_REQUIRED = (
    *("study", "point_index", "point", "realization", "method", "status"),
    *("seed", "schedule", "gospa_cutoff", "gospa_order"),
)


def row_key(row: Row) -> RowKey:
    """Return what identifies a row: study, point, realisation and method."""
    return row["study"], row["point_index"], row["realization"], row["method"]


def trial_of_row(row: Row) -> Trial:
    """Return the trial that made a row, with the row's method alone: run it to see it again."""
    return Trial(
        study=row["study"],
        point_index=row["point_index"],
        point=Point(**row["point"]),
        realization=row["realization"],
        methods=(row["method"],),
        settings=TrialSettings(
            seed=row["seed"],
            schedule=row["schedule"],
            gospa_cutoff=row["gospa_cutoff"],
            gospa_order=row["gospa_order"],
        ),
    )


def append_rows(file: TextIO, rows: Iterable[Row]) -> None:
    """Write rows in one go and hand them to the operating system."""
    file.write("".join(as_json(row) + "\n" for row in rows))
    file.flush()


def read_rows(path: str | Path) -> list[Row]:
    """Read all whole rows of a file; a torn last line is left out, repeated rows are kept once.

    Raises
    ------
    InputError
        If a line is no row of a study.
    OSError
        If the file cannot be read.
    """
    content = Path(path).read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    _require_torn_row(path, content[len(whole) :])
    rows = [_parse(path, number, line) for number, line in enumerate(whole.splitlines(), 1)]
    return list({row_key(row): row for row in rows}.values())


def repair(path: str | Path) -> None:
    """Cut a torn last line off.

    Raises
    ------
    InputError
        If what would be cut off is not the beginning of a row; nothing is changed.
    OSError
        If the file cannot be read or written.
    """
    content = Path(path).read_bytes()
    length = content.rfind(b"\n") + 1
    _require_torn_row(path, content[length:])
    if length < len(content):
        os.truncate(path, length)


def require_same_study(rows: Iterable[Row], study: Study, path: str | Path) -> None:
    """Refuse to mix rows of other settings into one file: a figure would average over both.

    Raises
    ------
    InputError
        If a row of this study has another seed, schedule, GOSPA or point.
    """
    settings = study.settings
    expected = {
        "seed": settings.seed,
        "schedule": settings.schedule,
        "gospa_cutoff": settings.gospa_cutoff,
        "gospa_order": settings.gospa_order,
    }
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
        if index >= len(study.points) or row["point"] != study.points[index].parameters():
            raise InputError(
                f"{path} holds rows of another point {index} of {study.name}; give another file."
            )


def _require_torn_row(path: str | Path, tail: bytes) -> None:
    if not (tail.startswith(_FIRST_KEY) or _FIRST_KEY.startswith(tail)):
        raise InputError(f"The last line of {path} is no row of a study; give another file.")


def _parse(path: str | Path, number: int, line: bytes) -> Row:
    try:
        row = json.loads(line)
    except ValueError:
        row = None
    if not isinstance(row, dict) or any(name not in row for name in _REQUIRED):
        raise InputError(f"Line {number} of {path} is no row of a study; give another file.")
    return row
