"""The estimators by the names that users call them."""

from dataclasses import fields
from typing import Any, Final, TypeAlias, TypedDict, Unpack

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.inference.core.estimator import Estimator
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.joint import JointSeparator
from vsep.inference.objects.masked import MaskedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.template import SignalModel

AnyEstimator: TypeAlias = (
    type[FactorisedSeparator] | type[ObjectOnlySeparator] | type[MaskedSeparator]
)

ESTIMATORS: Final[dict[str, AnyEstimator]] = {
    "factorised": FactorisedSeparator,
    "joint": JointSeparator,
    "object-only": ObjectOnlySeparator,
    "masked": MaskedSeparator,
}


SEVERAL_ANTENNAS: Final = ("factorised", "object-only")
"""Estimators that take what several antennas received apart together."""


def estimator_by_name(name: str) -> AnyEstimator:
    """Return the estimator class a user names.

    Raises
    ------
    InputError
        If there is none of that name.

    Examples
    --------
    >>> estimator_by_name("joint").__name__
    'JointSeparator'
    """
    if name not in ESTIMATORS:
        raise InputError(f"estimator is {name!r}; it must be one of {', '.join(ESTIMATORS)}.")
    return ESTIMATORS[name]


class EstimatorSettings(TypedDict, total=False):
    """Settings of the estimators; what is left out keeps its default."""

    false_alarm_rate: float
    object_threshold_db: float | None
    interference_threshold_db: float | None
    schedule: str
    max_iterations: int
    mask: BoolArray | None


def make_estimator(
    name: str, model: SignalModel, **settings: Unpack[EstimatorSettings]
) -> Estimator:
    """Make the estimator of a name; settings that it does not have play no part.

    Parameters
    ----------
    name : str
        One of `ESTIMATORS`.
    model : SignalModel
        Size, sampling and assumed filter.
    **settings
        See `FactorisedSeparator` and, for the mask of samples to ignore, `MaskedSeparator`.

    Raises
    ------
    InputError
        If the name is unknown or a setting out of its range.
    """
    kind = estimator_by_name(name)
    known = {field.name for field in fields(kind)}
    used: dict[str, Any] = {key: value for key, value in settings.items() if key in known}
    return kind(model=model, **used)
