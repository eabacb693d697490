"""A trial of a study as a link: one word of an address that opens exactly that trial.

The word is ``study/point/realization/method/seed/schedule``. A trial is a function of these, so
that a link needs no file of rows.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vsep._arrays import InputError, from_db
from vsep.files.frame import Frame
from vsep.inference.sbl import false_alarm_rate_from_threshold
from vsep.studies.catalogue import make_study
from vsep.studies.frames import trial_frame
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import Point, TrialSettings
from vsep.studies.trial import Row

TRIAL_KEY = "trial"
_FORM = "study/point/realization/method/seed/schedule"


@dataclass(frozen=True, kw_only=True)
class OpenedTrial:
    """A trial for the live view.

    Parameters
    ----------
    link : str
        The word that names it.
    frame : Frame
        What its method saw.
    values : mapping
        Settings under which the live view does what the trial did.
    """

    link: str
    frame: Frame
    values: Mapping[str, Any]


def trial_link(row: Row) -> str:
    """Return the word that names the trial and method of a row."""
    names = ("study", "point_index", "realization", "method", "seed", "schedule")
    return "/".join(str(row[name]) for name in names)


def open_trial(link: str) -> OpenedTrial:
    """Make the frame of a trial again, and the settings that go with it.

    Raises
    ------
    InputError
        If the word names no trial.

    Examples
    --------
    >>> open_trial("fig-3/20/17/no-interference/1/robust").values["estimator"]
    'object-only'
    """
    parts = link.split("/")
    if len(parts) != 6 or not all(parts[place].isdecimal() for place in (1, 2, 4)):
        raise InputError(f"trial is {link!r}; it must read {_FORM}.")
    name, index, realization, method, seed, schedule = parts
    study = make_study(
        name, methods=(method,), settings=TrialSettings(seed=int(seed), schedule=schedule)
    )
    trial = study.trial(int(index), int(realization))
    frame = trial_frame(trial, method)
    values = {"estimator": "object-only" if method == NO_INTERFERENCE else method}
    rate = _false_alarm_rate(trial.point, frame)
    rates = {} if rate is None else {"false_alarm_rate": rate}
    return OpenedTrial(link=link, frame=frame, values={**values, "schedule": schedule, **rates})


def trial_of_query(
    query: Mapping[str, Any],
) -> tuple[OpenedTrial | None, dict[str, Any], list[str]]:
    """Return the trial that an address names, the rest of its query, and what is wrong with it."""
    rest = {key: value for key, value in query.items() if key != TRIAL_KEY}
    if TRIAL_KEY not in query:
        return None, rest, []
    # The live view writes the loaded frame into its address; here the trial brings it.
    rest.pop("preset", None)
    try:
        return open_trial(str(query[TRIAL_KEY])), rest, []
    except InputError as error:
        return None, rest, [str(error)]


def _false_alarm_rate(point: Point, frame: Frame) -> float | None:
    """Return the rate that stands for the point's threshold; None is the estimators' default."""
    if point.object_threshold_db is None:
        return point.false_alarm_rate
    return false_alarm_rate_from_threshold(
        float(from_db(point.object_threshold_db)), *frame.received.shape
    )
