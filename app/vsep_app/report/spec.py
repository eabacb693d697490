"""Report spec: all that determines a report, as data that the report itself carries.

A `ReportSpec` is a plan, as for the live view, with the frame or the trial that the plan does not
determine, and what is shown of the run. Two reports of equal specs, made by the same versions on
the same machine, are equal to the bit.
"""

import base64
import binascii
import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import param

from vsep.errors import InputError, shown
from vsep.inference.registry import ESTIMATORS
from vsep_app.model.settings import LOADED_FRAME, Plan, Settings

MAX_KEPT = 2**20
"""Bytes of the largest frame file that a report keeps; of a larger one it keeps name and hash."""

_SHA256_DIGITS = 64
# Whoever uses these numbers checks them; the command line may go beyond the sliders.
_CHECKED_IN_USE = (
    "snr_db",
    "sir_db",
    "seed",
    "false_alarm_rate",
    "object_threshold_db",
    "max_iterations",
)


@dataclass(frozen=True, kw_only=True)
class KeptFrame:
    """A frame file: its name and all its bytes."""

    name: str
    content: bytes

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True, kw_only=True)
class ReportSpec:
    """All that determines a report."""

    plan: Plan  #: Scene and estimator; the scene of a loaded frame comes from `frame` or `trial`.
    frame: KeptFrame | None = None  #: The frame file.
    antenna: int = 0  #: Which antenna of the frame file.
    #: Whether all antennas are separated together, and that one shown; else that one alone.
    together: bool = False
    trial: str = ""  #: Link of a study's trial, empty where there is none.
    #: How the masked estimator finds interfered samples; None is its default.
    mask: str | None = None
    #: Threshold of interference paths; None is that of the schedule.
    interference_threshold_db: float | None = None
    ramp: int | None = None  #: Ramp shown; None: the one with the strongest burst.
    iteration: int | None = None  #: Iteration shown; None: the last one.
    iterations: tuple[int, ...] = ()  #: Iterations of the filmstrip, none for no strip.
    fast_time: str = "level"  #: "level" or "real".


def default_plan(preset: str = LOADED_FRAME) -> Plan:
    """Return the plan of a preset, or of a loaded frame, with everything else at its default."""
    settings = Settings()
    settings.choose_preset(preset)
    return settings.plan()


def spec_data(spec: ReportSpec) -> dict[str, Any]:
    """Return a spec as texts, numbers, lists and dictionaries."""
    others = {each.name: getattr(spec, each.name) for each in fields(spec)}
    data = {**others, "plan": asdict(spec.plan), "iterations": list(spec.iterations)}
    if spec.frame is not None:
        content = spec.frame.content
        kept = base64.b64encode(content).decode() if len(content) <= MAX_KEPT else None
        data["frame"] = {"name": spec.frame.name, "sha256": spec.frame.fingerprint, "npz": kept}
    return data


def read_spec(data: Any, name: str, frame: KeptFrame | None = None) -> ReportSpec:
    """Return the spec that `spec_data` wrote.

    Parameters
    ----------
    data : object
        What was read; nobody vouches for it.
    name : str
        What the sentences of an `InputError` call its file.
    frame : KeptFrame or None
        The frame file, for a report that does not keep it.

    Raises
    ------
    InputError
        If it is no spec, or a frame is needed and missing or another one.
    """
    if not isinstance(data, Mapping) or set(data) != {each.name for each in fields(ReportSpec)}:
        raise InputError(f"{name} does not say how it was made; give a report of this version.")
    for key, good in _CHECKS.items():
        if not good(data[key]):
            raise InputError(f"{name} says {key} is {shown(data[key])}, which cannot be used.")
    return ReportSpec(
        plan=_read_plan(data["plan"], name),
        frame=_read_frame(data["frame"], name, frame),
        iterations=tuple(data["iterations"]),
        **{key: data[key] for key in _CHECKS if key != "iterations"},
    )


_MAX_NUMBER = 1e300
_MAX_TEXT = 4000  # of objects' places
_MAX_COUNT = 2**31  # of ramps, antennas, iterations


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_count(value: Any) -> bool:
    return _is_whole(value) and value < _MAX_COUNT


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    # An integer may be larger than all floating-point numbers.
    return abs(value) < _MAX_NUMBER


_CHECKS = {
    "antenna": _is_count,
    "together": lambda value: isinstance(value, bool),
    "trial": lambda value: isinstance(value, str),
    "mask": lambda value: value is None or isinstance(value, str),
    "interference_threshold_db": lambda value: value is None or _is_number(value),
    "ramp": lambda value: value is None or _is_count(value),
    "iteration": lambda value: value is None or _is_count(value),
    "iterations": lambda value: isinstance(value, list) and all(map(_is_count, value)),
    "fast_time": lambda value: value in Settings.param.fast_time.objects,
}


def _read_plan(data: Any, name: str) -> Plan:
    names = {each.name for each in fields(Plan)}
    if not isinstance(data, Mapping) or set(data) != names:
        raise InputError(f"{name} holds no plan of a run; give a report of this version.")
    for key, value in data.items():
        if not _suits(key, value):
            raise InputError(f"{name} says {key} is {shown(value)}, which cannot be used.")
    return Plan(**data)


def _suits(key: str, value: Any) -> bool:
    parameter = Settings.param[key]
    if key == "estimator":
        return isinstance(value, str) and value in ESTIMATORS
    if isinstance(parameter, param.Selector):
        return value in parameter.objects
    if isinstance(parameter, param.Boolean):
        return isinstance(value, bool)
    if value is None or isinstance(parameter, param.String):
        known = isinstance(value, str) and len(value) < _MAX_TEXT
        return known or (value is None and bool(parameter.allow_None))
    if not _is_number(value) or (isinstance(parameter, param.Integer) and not _is_whole(value)):
        return False
    lowest, highest = parameter.bounds
    return key in _CHECKED_IN_USE or bool(lowest <= value <= highest)


def _read_frame(data: Any, name: str, given: KeptFrame | None) -> KeptFrame | None:
    if data is None:
        if given is not None:
            raise InputError(f"{name} was made without a frame file; leave {given.name} out.")
        return None
    if not isinstance(data, Mapping) or not (
        isinstance(data.get("name"), str)
        and isinstance(data.get("sha256"), str)
        and len(data["sha256"]) == _SHA256_DIGITS
    ):
        raise InputError(f"{name} does not say which frame it shows; give a whole report.")
    if given is None and not isinstance(data.get("npz"), str):
        raise InputError(
            f"{name} does not keep its frame, which is too large; give {data['name']} as well."
        )
    frame = given or KeptFrame(name=data["name"], content=_decoded(data["npz"], name))
    if frame.fingerprint != data["sha256"]:
        raise InputError(f"{frame.name} is not the frame of {name}; give the file it was made of.")
    return KeptFrame(name=data["name"], content=frame.content)


def _decoded(text: str, name: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise InputError(f"{name} keeps a damaged frame; give a whole report.") from error
