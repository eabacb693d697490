"""What is compared: every registered estimator and mitigation method, and no interference at all.

A mitigation method is given the perfect mask, and the object-only estimator its cleaned frame; the
masked estimator ignores the samples of the same mask. So none of them pays for finding the bursts,
which the separation does by itself. "masked-autoregressive" does pay: it is the masked estimator
with the mask that the prediction errors of an autoregressive model give.

What a poor repair leaves in the gaps takes the estimator a hundred objects and up to a minute to
explain. After a repair it therefore has `ITERATIONS_AFTER_REPAIR` iterations, twice what a frame
without interference needs; false alarms of such methods are a lower bound.

"no-interference" is the object-only estimator on the same objects and the same noise without the
bursts. Paired with it, a method's cost is seen ten times sharper than in an average.
"""

from typing import Final

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.inference import registry as estimators
from vsep.inference.core.estimator import Estimator
from vsep.inference.registry import ESTIMATORS, EstimatorSettings
from vsep.mitigation.registry import MITIGATIONS
from vsep.signal.template import SignalModel
from vsep.studies.study import Point, TrialSettings

NO_INTERFERENCE = "no-interference"
MASKED: Final = "masked"
MASKED_BY_DETECTOR: Final = {"masked-autoregressive": "autoregressive"}
"""Detectors of `vsep.mitigation.masks` by the methods that give their mask to the masked one."""
ITERATIONS_AFTER_REPAIR: Final = 20


def method_names() -> tuple[str, ...]:
    """Return the names of all methods, the reference last."""
    return (*ESTIMATORS, *MASKED_BY_DETECTOR, *MITIGATIONS, NO_INTERFERENCE)


def estimator_names() -> tuple[str, ...]:
    """Return the names of the methods that work on the received frame, the reference last."""
    return (*ESTIMATORS, NO_INTERFERENCE)


def require_methods(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names if there is at least one, all are known and none is given twice.

    Raises
    ------
    InputError
        Otherwise.

    Examples
    --------
    >>> require_methods(("factorised", "no-interference"))
    ('factorised', 'no-interference')
    """
    known = method_names()
    for name in names:
        if name not in known:
            raise InputError(f"method is {name!r}; it must be one of {', '.join(known)}.")
    if len(set(names)) != len(names) or not names:
        listed = ", ".join(names) or "none"
        raise InputError(f"The methods are {listed}; each must be named once, at least one.")
    return names


def make_estimator(
    method: str,
    model: SignalModel,
    point: Point,
    settings: TrialSettings,
    mask: BoolArray | None = None,
) -> Estimator:
    """Return the estimator of a method, with the threshold of a point.

    That of a mitigation method, which is run first, is the object-only one.

    Parameters
    ----------
    method : str
        One of `method_names`.
    model : SignalModel
        Size, sampling and *assumed* filter.
    point : Point
        Gives the threshold.
    settings : TrialSettings
        Give the schedule, to those that have one.
    mask : (P, N) bool, optional
        Interfered samples, for the masked estimator.

    Raises
    ------
    InputError
        If the method is unknown or the threshold out of range.
    """
    require_methods((method,))
    name = MASKED if method in MASKED_BY_DETECTOR else method
    name = name if name in ESTIMATORS else "object-only"
    options: EstimatorSettings = {
        "object_threshold_db": point.object_threshold_db,
        "schedule": settings.schedule,
        "mask": mask,
    }
    if point.false_alarm_rate is not None:
        options["false_alarm_rate"] = point.false_alarm_rate
    if method in MITIGATIONS:
        options["max_iterations"] = ITERATIONS_AFTER_REPAIR
    return estimators.make_estimator(name, model, **options)
