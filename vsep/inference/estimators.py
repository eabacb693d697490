"""The estimators by the names that users call them."""

from typing import Final

from vsep._arrays import InputError
from vsep.inference.joint import JointSeparator
from vsep.inference.object_only import ObjectOnlySeparator
from vsep.inference.separator import FactorisedSeparator

ESTIMATORS: Final[dict[str, type[FactorisedSeparator] | type[ObjectOnlySeparator]]] = {
    "factorised": FactorisedSeparator,
    "joint": JointSeparator,
    "object-only": ObjectOnlySeparator,
}


def estimator_by_name(name: str) -> type[FactorisedSeparator] | type[ObjectOnlySeparator]:
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
