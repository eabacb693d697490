"""Settings of a comparison: two to four methods and the detector of interfered samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import param

from vsep.errors import InputError, shown
from vsep.files.frame_mask import MASK_NAMES
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS
from vsep.mitigation.sparse.prior import SeenFrame
from vsep.registry import Entry
from vsep_app.model.settings import Plan
from vsep_app.model.url import as_given
from vsep_app.pages.compare.metrics import FrameResult

MIN_METHODS, MAX_METHODS = 2, 4
NO_METHOD = ""
# Objects of the simulations drive some 10 m in this time, which takes near ones through the radar.
LAST_FRAME = 20
_FIRST = ("zeroing", "autoregressive", "iht", "masked", "factorised", "joint")
METHODS_KEY, MASK_KEY, DEBIAS_KEY = "methods", "mask", "debias"


class CompareSettings(param.Parameterized):
    """What is compared; the scene is that of `Settings`."""

    methods: Any = param.List(
        default=["zeroing", "autoregressive", "masked", "factorised"],
        item_type=str,
        bounds=(MIN_METHODS, MAX_METHODS),
        doc="Repairs of interfered samples are followed by the object-only estimator on the "
        "cleaned frame; masked ignores the samples; factorised and joint find the bursts "
        "themselves; object-only knows nothing of bursts.",
    )
    mask: Any = param.Selector(
        default="truth",
        objects=list(MASK_NAMES),
        label="Mask",
        doc="How interfered samples are found, for repairs and for masked: perfect, from the truth "
        "of the simulation; by amplitude; by the prediction error of an autoregressive model; by "
        "the residual of fitted objects.",
    )
    debias = param.Boolean(
        default=False,
        label="Debias",
        doc="Compressive sensing ends with a least-squares fit of the cells found.",
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparePlan:
    """All that determines a comparison; frozen and picklable."""

    scene: Plan  #: The scene and the estimators' settings.
    methods: tuple[str, ...]  #: Names out of `method_entries`.
    mask: str  #: How interfered samples are found.
    debias: bool  #: Whether compressive sensing ends with a least-squares fit.
    frame_number: int  #: Which frame of the sequence.
    #: What methods with a prior have seen of the last frames.
    histories: Mapping[str, tuple[SeenFrame, ...]]
    past: tuple[FrameResult, ...]  #: How the methods did on earlier frames.


def method_entries() -> list[Entry]:
    """Return the records of all methods that can be compared; repairs come first."""
    return [*MITIGATIONS.values(), *ESTIMATORS.values()]


def method_groups() -> dict[str, list[str]]:
    """Return the names of all methods by groups; the first one holds those to begin with.

    Examples
    --------
    >>> [*method_groups()][0], method_groups()["Estimators"]
    ('To begin with', ['object-only', 'evidence'])
    """
    groups: dict[str, list[str]] = {"To begin with": [*_FIRST]}
    for name, entry in MITIGATIONS.items():
        groups.setdefault(entry.group, []).append(name)
    groups["Estimators"] = [*ESTIMATORS]
    return {
        group: [name for name in names if group == "To begin with" or name not in _FIRST]
        for group, names in groups.items()
    }


def require_distinct(methods: list[str]) -> list[str]:
    """Return the names if they are two to four different methods.

    Raises `InputError` otherwise.

    Examples
    --------
    >>> require_distinct(["iht", "masked"])
    ['iht', 'masked']
    """
    known = [entry.name for entry in method_entries()]
    for name in methods:
        if name not in known:
            raise InputError(f"method is {shown(name)}; it must be one of {', '.join(known)}.")
    twice = [name for name in methods if methods.count(name) > 1]
    if twice:
        raise InputError(f"{twice[0]} is chosen twice; the methods must differ.")
    if not MIN_METHODS <= len(methods) <= MAX_METHODS:
        raise InputError(
            f"The number of methods is {len(methods)}; it must lie between {MIN_METHODS} and "
            f"{MAX_METHODS}."
        )
    return methods


def parse_choice(query: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return what an address chooses to compare, and one sentence for all that is no choice.

    Examples
    --------
    >>> parse_choice({"methods": "iht,masked", "mask": "magic"})[0]
    {'methods': ['iht', 'masked']}
    """
    values: dict[str, Any] = {}
    errors: list[str] = []
    if METHODS_KEY in query:
        try:
            values["methods"] = require_distinct(str(query[METHODS_KEY]).split(","))
        except InputError as error:
            errors.append(str(error))
    mask = query.get(MASK_KEY)
    if isinstance(mask, str) and mask in MASK_NAMES:
        values["mask"] = mask
    elif mask is not None:
        errors.append(f"{MASK_KEY} is {as_given(mask)}; it must be one of {', '.join(MASK_NAMES)}.")
    debias = query.get(DEBIAS_KEY)
    if debias is not None:
        if str(debias).lower() in ("true", "false"):
            values["debias"] = str(debias).lower() == "true"
        else:
            errors.append(f"{DEBIAS_KEY} is {as_given(debias)}; it must be true or false.")
    return values, errors
