"""Report specs from a frame file, a preset, a study's trial, a link or a report."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from vsep.errors import InputError, shown
from vsep.files.frame import read_frame
from vsep.files.writing import printable
from vsep.inference.registry import ESTIMATORS
from vsep.presets.registry import PRESETS
from vsep.recordings.configurations.registry import (
    merged,
    read_configuration_file,
    settings_of,
)
from vsep.recordings.convert import convert_recording
from vsep.studies.rows import read_rows
from vsep_app.jobs.frame_store import frame_bytes
from vsep_app.model.settings import LOADED_FRAME, PLAN_NAMES, Settings
from vsep_app.model.trial_link import open_trial, trial_link, trial_of_query
from vsep_app.model.url import parse_iteration, parse_query
from vsep_app.report.metadata import read_provenance
from vsep_app.report.spec import KeptFrame, ReportSpec, default_plan, read_spec

_INDEX = re.compile(r"[0-9]{1,10}")
_MAX_LINK = 4096  # characters
_TRIAL_FORM = "POINT/REALIZATION or POINT/REALIZATION/METHOD"


def kept_frame(path: str) -> KeptFrame:
    """Return a frame file with all its bytes.

    Raises `InputError` if it is no frame file.
    """
    read_frame(path)
    return KeptFrame(name=printable(path), content=Path(path).read_bytes())


def of_frame(path: str) -> ReportSpec:
    """Return the spec of a frame file."""
    return ReportSpec(plan=default_plan(), frame=kept_frame(path))


def of_recording(path: str, settings: Sequence[str]) -> tuple[ReportSpec, tuple[str, ...]]:
    """Return the spec of a sensor's recording, and what looks wrong with its settings.

    Raises `InputError` if the recording or a file of settings cannot be used.
    """
    said = merged({name: read_configuration_file(name) for name in settings})
    found = settings_of(said, path, ", ".join(settings))
    frame, remarks = convert_recording(path, found)
    content = frame_bytes(frame)
    kept = KeptFrame(name=printable(path), content=content)
    return ReportSpec(plan=default_plan(), frame=kept), (*said.remarks, *remarks)


def of_preset(preset: str) -> ReportSpec:
    """Return the spec of a preset with its defaults.

    Raises `InputError` if there is none of that name.
    """
    if preset not in PRESETS:
        raise InputError(f"preset is {shown(preset)}; it must be one of {', '.join(PRESETS)}.")
    return ReportSpec(plan=default_plan(preset))


def of_trial(link: str) -> ReportSpec:
    """Return the spec of a trial of a study, named by its link.

    Raises `InputError` if the link names no trial, or one that the live view cannot repeat.
    """
    opened = open_trial(link)
    return ReportSpec(plan=replace(default_plan(), **opened.values), trial=link)


def of_rows(path: str, which: str) -> ReportSpec:
    """Return the spec of a trial whose row is in the file of a study.

    `which` names point, realisation and, where the file has several, method: ``20/17/factorised``.
    Raises `InputError` if there is no such row, or the live view cannot repeat it.
    """
    parts = which.split("/")
    if len(parts) not in (2, 3) or not all(_INDEX.fullmatch(part) for part in parts[:2]):
        raise InputError(f"trial is {shown(which)}; with rows it must read {_TRIAL_FORM}.")
    place = tuple(int(part) for part in parts[:2])
    rows = [
        row
        for row in read_rows(path)
        if (row["point_index"], row["realization"]) == place
        and (len(parts) == 2 or row["method"] == parts[2])
    ]
    if not rows:
        raise InputError(
            f"{path} has no row of trial {shown(which)}; see its point_index, realization."
        )
    links = [link for link in map(trial_link, rows) if link]
    if not links:
        raise InputError(f"Trial {which} of {path} cannot be drawn: its method has no iterations.")
    return of_trial(links[0])


def of_link(url: str) -> ReportSpec:
    """Return the spec of a shared link: its scene, estimator, ramp and iteration.

    Raises `InputError` if something in the link cannot be used.
    """
    if len(url) > _MAX_LINK:
        raise InputError(f"The link has {len(url)} characters; at most {_MAX_LINK} are read.")
    try:
        query = dict(parse_qsl(urlsplit(url).query, keep_blank_values=True))
    except ValueError as error:
        raise InputError("The link cannot be read; copy it from the page.") from error
    trial, scene, errors = trial_of_query(query)
    values, more = parse_query(scene)
    iteration, last = parse_iteration(scene)
    wrong = [*errors, *more, *last]
    if wrong:
        raise InputError(wrong[0])
    if trial is not None:
        values = {"preset": LOADED_FRAME, **trial.values, **values}
    settings = Settings(**values)
    return ReportSpec(
        plan=settings.plan(),
        trial="" if trial is None else trial.link,
        ramp=settings.ramp if "ramp" in values else None,
        iteration=iteration,
        fast_time=settings.fast_time,
    )


def of_report(path: str, frame: KeptFrame | None = None) -> ReportSpec:
    """Return the spec that a report carries.

    Raises `InputError` if it carries none, or needs its frame and that is not given.
    """
    return read_spec(read_provenance(path)["spec"], path, frame)


def changed(spec: ReportSpec, given: Mapping[str, Any]) -> ReportSpec:
    """Return a spec with other settings, given by their names in `Plan` or `ReportSpec`.

    Raises `InputError` if a setting is given that the estimator does not have.
    """
    values = dict(given)
    if "false_alarm_rate" in values:
        values.setdefault("object_threshold_db", None)
    of_plan = {name: values.pop(name) for name in tuple(values) if name in PLAN_NAMES}
    new = replace(spec, plan=replace(spec.plan, **of_plan), **values)
    chosen = {name: value for name, value in given.items() if name in ESTIMATORS.settings}
    ESTIMATORS.require_settings(new.plan.estimator, chosen)
    return new
