"""Methods of a study: the registered estimators and mitigation methods, and the reference.

A mitigation method is given the perfect mask, and the object-only estimator its cleaned frame; the
masked estimator ignores the samples of the same mask. So none of them pays for finding the bursts,
which the separation does by itself. "masked-autoregressive" does pay: it is the masked estimator
with the mask that the prediction errors of an autoregressive model give.

What a poor repair leaves in the gaps takes the estimator a hundred objects and up to a minute to
explain. After a repair it therefore has `ITERATIONS_AFTER_REPAIR` iterations, twice what a frame
without interference needs; false alarms of such methods are a lower bound.

"no-interference" is the object-only estimator on the same objects and the same noise without the
bursts. Paired with it, a method's cost is seen ten times sharper than in an average.

A method that is not registered is handed over as an object: a mitigation method itself, a class or
an entry.
"""

from collections.abc import Iterable
from inspect import signature
from typing import Any, Final, NamedTuple, TypeAlias

from vsep._entry_points import require_loadable
from vsep._typing import BoolArray
from vsep.errors import InputError, shown
from vsep.inference.core.estimator import Estimator, EstimatorEntry
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.entry import MitigationEntry
from vsep.mitigation.registry import MITIGATIONS
from vsep.registry import Entry
from vsep.signal.template import SignalModel
from vsep.studies.study import Point, TrialSettings

NO_INTERFERENCE = "no-interference"
MASKED: Final = "masked"
MASKED_BY_DETECTOR: Final = {"masked-autoregressive": "autoregressive"}
"""Detectors of `vsep.mitigation.masks` by the methods that give their mask to the masked one."""
ITERATIONS_AFTER_REPAIR: Final = 20


Handed: TypeAlias = tuple[Entry, ...]
"""Entries of methods that are not registered."""


class Methods(NamedTuple):
    """Names of methods, and the entries of those that are not registered."""

    names: tuple[str, ...]
    handed: Handed


def method_names() -> tuple[str, ...]:
    """Return the names of all methods, the reference last."""
    return (*ESTIMATORS, *MASKED_BY_DETECTOR, *MITIGATIONS, NO_INTERFERENCE)


def estimator_names() -> tuple[str, ...]:
    """Return the estimators that every study runs, the reference last."""
    usual = (name for name, entry in ESTIMATORS.items() if entry.in_every_study)
    return (*usual, NO_INTERFERENCE)


def read_methods(methods: Iterable[Any]) -> Methods:
    """Return what a caller named or handed over.

    Parameters
    ----------
    methods : iterable
        Of names, mitigation methods, classes of estimators or mitigation methods, and entries.

    Raises
    ------
    InputError
        If something is no method, a name is unknown or bears two methods.

    Examples
    --------
    >>> from vsep.mitigation.blanking import blanking
    >>> soft = MitigationEntry(name="soft", factory=blanking)
    >>> read_methods(["factorised", soft]).names
    ('factorised', 'soft')
    """
    given = [method if isinstance(method, str) else entry_of(method) for method in methods]
    handed = tuple(one for one in given if isinstance(one, Entry))
    for entry in handed:
        if entry.name in method_names():
            raise InputError(
                f"The method handed over is named {entry.name}, as one of vsep; rename it."
            )
    names = tuple(one.name if isinstance(one, Entry) else one for one in given)
    return Methods(require_methods(names, handed), handed)


def entry_of(method: Any) -> Entry:
    """Return the entry of a method that is handed over as an object.

    Raises `InputError` if it is no method, or an estimator of one frame: a study makes its own for
    every point.
    """
    if isinstance(method, EstimatorEntry | MitigationEntry):
        return method
    if callable(method):
        kind = EstimatorEntry if "model" in signature(method).parameters else MitigationEntry
        entry = kind.of(method)
        # A mitigation method bears its name itself.
        return entry if kind is EstimatorEntry else kind.of(method, entry.make().name)
    if hasattr(method, "model"):
        raise InputError(
            f"{type(method).__name__} is handed over for one frame size; give its class, or an "
            "EstimatorEntry that says which settings it has: a study makes it for every point."
        )
    if not all(hasattr(method, name) for name in ("name", "init", "step", "terminate")):
        raise InputError(
            f"{method!r} is no method; it must be a name, a mitigation method, a class or an entry."
        )
    return MitigationEntry(name=method.name, factory=_Ready(method))


class _Ready:
    """A factory that returns what is ready."""

    def __init__(self, method: Any) -> None:
        self._method = method

    def __call__(self) -> Any:
        """Return it."""
        return self._method


def require_methods(names: tuple[str, ...], handed: Handed = ()) -> tuple[str, ...]:
    """Return the names if there is at least one, all are known and none is given twice.

    Those of entries handed over are known as well.

    Raises `InputError` otherwise.

    Examples
    --------
    >>> require_methods(("factorised", "no-interference"))
    ('factorised', 'no-interference')
    """
    known = (*method_names(), *(entry.name for entry in handed))
    for name in names:
        if name not in known:
            _require_loadable(name)
            raise InputError(f"method is {shown(name)}; it must be one of {', '.join(known)}.")
    if len(set(names)) != len(names) or not names:
        listed = ", ".join(names) or "none"
        raise InputError(f"The methods are {listed}; each must be named once, at least one.")
    return names


def repair_of(method: str, handed: Handed = ()) -> MitigationEntry | None:
    """Return the mitigation method that repairs the frame first; None for the other methods."""
    found = _handed(method, handed) or MITIGATIONS.get(method)
    return found if isinstance(found, MitigationEntry) else None


def trial_estimator(
    method: str,
    model: SignalModel,
    point: Point,
    settings: TrialSettings,
    mask: BoolArray | None = None,
    handed: Handed = (),
    *,
    max_iterations: int | None = None,
) -> Estimator:
    """Return the estimator of a method, with the threshold of a point.

    That of a mitigation method, which is run first, is the object-only one.

    Parameters
    ----------
    method : str
        One of `method_names`, or of the entries handed over.
    model : SignalModel
        Size, sampling and *assumed* filter.
    point : Point
        Gives the threshold.
    settings : TrialSettings
        Give the schedule, to those that have one.
    mask : (P, N) bool, optional
        Interfered samples, for estimators that need them.
    handed : tuple of Entry
        Entries of methods that are not registered.
    max_iterations : int, optional
        Where a run stops at the latest, in the place of the estimator's own limit.

    Raises
    ------
    InputError
        If the method is unknown or the threshold out of range.
    """
    require_methods((method,), handed)
    limits = [
        max_iterations,
        None if repair_of(method, handed) is None else ITERATIONS_AFTER_REPAIR,
    ]
    entry = _handed(method, handed)
    if not isinstance(entry, EstimatorEntry):
        name = MASKED if method in MASKED_BY_DETECTOR else method
        entry = ESTIMATORS[name if name in ESTIMATORS else "object-only"]
    # A study has one set of settings for all of its methods: each takes those that it has.
    options = entry.accepted(
        object_threshold_db=point.object_threshold_db,
        false_alarm_rate=point.false_alarm_rate,
        interference_threshold_db=point.interference_threshold_db,
        schedule=settings.schedule,
        mask=mask,
        max_iterations=min((limit for limit in limits if limit is not None), default=None),
    )
    estimator: Estimator = entry.make(model=model, **options)
    return estimator


def _handed(name: str, handed: Handed) -> Entry | None:
    return next((entry for entry in handed if entry.name == name), None)


def _require_loadable(name: str) -> None:
    for group in ("vsep.estimators", "vsep.mitigations"):
        require_loadable(group, name)
