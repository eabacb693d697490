"""A trial of a study as a link: one word of an address that opens exactly that trial.

The word is ``study/point/realization/method/seed/schedule``, and the threshold behind it if it is
not the point's own; `vsep.separability.trial_word` has that of a cell of a separability map. A
trial is a function of these, so that a link needs no file of rows. The live view makes the same
frame and runs the same estimator: with the same number of linear-algebra threads as the study's
workers, which is one, its result is the same to the bit.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from vsep.errors import InputError, shown
from vsep.files.frame import Frame
from vsep.parameters import PARAMETERS
from vsep.presets.registry import NOISE_SCENES, PRESETS
from vsep.separability.trial_word import is_map_trial_word, trial_of_word
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.frames import trial_frame
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import DRAWN, Point, Trial, TrialSettings, point_of
from vsep.studies.trial import DONE, Row
from vsep.studies.trial_scenario import preset_name
from vsep_app.model.settings import Settings, preset_values

TRIAL_KEY = "trial"
_FORM = "study/point/realization/method/seed/schedule"
_WORD = re.compile(
    r"(?P<study>[^/]+)/(?P<point>[0-9]{1,9})/(?P<realization>[0-9]{1,10})/(?P<method>[^/]+)"
    r"/(?P<seed>[0-9]{1,19})/(?P<schedule>[^/]+)(/(?P<threshold>[0-9.e+-]+))?"
)


@dataclass(frozen=True, kw_only=True)
class OpenedTrial:
    """A trial for the live view."""

    link: str  #: The word that names it.
    frame: Frame  #: What its method saw.
    values: Mapping[str, Any]  #: Settings under which the live view does what the trial did.
    #: Settings of its scene, with the preset that it was drawn from; empty for noise alone. What a
    #: preset cannot be told, as another number of objects, is not among them.
    scene: Mapping[str, Any]


def trial_link(row: Row) -> str:
    """Return the word that names the trial and method of a row.

    It is empty where the live view cannot repeat it: without a result, with a method that the view
    does not have, or at a point that the catalogue has no more.
    """
    if row["status"] != DONE or _estimator(row["method"]) is None:
        return ""
    index, threshold = row["point_index"], row["point"].get("object_threshold_db")
    names = ("study", "point_index", "realization", "method", "seed", "schedule")
    word = "/".join(str(row[name]) for name in names)
    # As a point: a row of an older version has no entry for what a point has got since.
    point = point_of(row["point"]).parameters()
    if point == _point_parameters(row["study"], index, None):
        return word
    if threshold is not None and point == _point_parameters(row["study"], index, threshold):
        return f"{word}/{threshold!r}"
    return ""


def open_trial(link: str) -> OpenedTrial:
    """Make the frame of a trial again, and the settings that go with it.

    Raises `InputError` if the word names no trial, or one that the live view cannot repeat.

    Examples
    --------
    >>> open_trial("fig-3/20/17/no-interference/1/robust").values["estimator"]
    'object-only'
    """
    if is_map_trial_word(link):
        return _opened(link, trial_of_word(link))
    word = _WORD.fullmatch(link)
    if word is None:
        raise InputError(f"trial is {shown(link)}; it must read {_FORM}.")
    method, schedule = word["method"], word["schedule"]
    study = make_study(
        word["study"],
        methods=(method,),
        settings=TrialSettings(seed=int(word["seed"]), schedule=schedule),
        object_threshold_db=_threshold(word["threshold"]),
    )
    return _opened(link, study.trial(int(word["point"]), int(word["realization"])))


def _opened(link: str, trial: Trial) -> OpenedTrial:
    """Return a trial of one method with what the live view needs for it."""
    (method,) = trial.methods
    estimator = _estimator(method)
    if estimator is None:
        raise InputError(f"trial is {shown(link)}; the live view has no method {method}.")
    schedule = trial.settings.schedule
    values = {"estimator": estimator, "schedule": schedule, **_threshold_values(trial.point)}
    scene = _scene_values(trial, has_bursts=method != NO_INTERFERENCE)
    return OpenedTrial(link=link, frame=trial_frame(trial, method), values=values, scene=scene)


def _scene_values(trial: Trial, *, has_bursts: bool) -> dict[str, Any]:
    """Return the settings of the scene of a trial, in the units of the controls."""
    point = trial.point
    if point.scene in (*NOISE_SCENES, *DRAWN):
        return {}
    name = preset_name(point, trial.realization)
    values = preset_values(name)
    slope, cutoff = point.interferer_slope_hz_per_s, point.filter_cutoff_hz
    if slope is not None:
        values["interferer_slope"] = PARAMETERS["interferer_slope"].shown(slope)
    if cutoff is not None:
        values["filter_cutoff"] = PARAMETERS["filter_cutoff"].shown(cutoff)
    if point.butterworth_order:
        values |= {"filter_kind": "butterworth", "filter_order": point.butterworth_order}
    del values["ramp"]
    values |= {
        "snr_db": point.snr_db,
        "sir_db": point.sir_db,
        "interference": has_bursts,
        "interference_model": point.interference_model,
        "assume_true_filter": not (point.butterworth_order or point.filter_mismatch),
        "assumed_cutoff": values["filter_cutoff"] * (1.0 + point.filter_mismatch),
        "assumed_rolloff": PRESETS[name].filter_rolloff,
        "filter_rolloff": PRESETS[name].filter_rolloff,
    }
    return values


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


@lru_cache(maxsize=512)
def _point_parameters(study: str, index: int, threshold_db: float | None) -> dict[str, Any] | None:
    """Return the parameters of a point of the catalogue, None if there is no such point."""
    if study not in CATALOGUE or not 0 <= index < len(CATALOGUE[study].points):
        return None
    return make_study(study, object_threshold_db=threshold_db).points[index].parameters()


def _estimator(method: str) -> str | None:
    """Return the live view's name of a method, None if it has none."""
    name = "object-only" if method == NO_INTERFERENCE else method
    return name if name in Settings.param.estimator.objects else None


def _threshold(text: str | None) -> float | None:
    try:
        return None if text is None else float(text)
    except ValueError as error:
        raise InputError(
            f"The threshold of the trial is {shown(text)}; it must be a number."
        ) from error


def _threshold_values(point: Point) -> dict[str, float]:
    """Return the setting that the point's threshold comes from; none is the estimators' default."""
    if point.object_threshold_db is not None:
        return {"object_threshold_db": point.object_threshold_db}
    if point.false_alarm_rate is not None:
        return {"false_alarm_rate": point.false_alarm_rate}
    return {}
