"""Registry of the estimators."""

from typing import Any, Final

import numpy as np

from vsep._typing import BoolArray
from vsep._validation import require_choice
from vsep.errors import InputError
from vsep.inference.accelerating import AcceleratingSeparator
from vsep.inference.core.estimator import Estimator, EstimatorEntry
from vsep.inference.objects.object_only import ObjectSettings
from vsep.parameters import PARAMETERS
from vsep.registry import Registry
from vsep.signal.template import SignalModel

ESTIMATORS: Final = Registry(EstimatorEntry, "vsep.inference", "vsep.estimators")
"""The estimators of this package and of other distributions by name."""


def make_estimator(
    name: str,
    model: SignalModel,
    *,
    missing: BoolArray | None = None,
    acceleration: str | None = None,
    **settings: Any,
) -> Estimator:
    """Make the estimator of a name.

    Parameters
    ----------
    name : str
        One of `ESTIMATORS`.
    model : SignalModel
        Size, sampling and assumed filter.
    missing : (P, N) or (A, P, N) bool, optional
        Samples that were never received.
    acceleration : {"neglected", "modelled"}, optional
        Whether objects that accelerate are modelled, see `vsep.inference.accelerating`; by
        estimators of this package.
    **settings
        Those that the estimator has, see `EstimatorEntry.settings` and `FactorisedSeparator`; None
        stands for the default.

    Raises
    ------
    InputError
        If the name is unknown, the estimator has no such setting, a value is out of its range, or
        samples are missing and the estimator cannot leave any out.

    Examples
    --------
    >>> from vsep.signal.filters import NoFilter
    >>> model = SignalModel(num_ramps=1, num_samples=128, sample_rate_hz=5.1e6,
    ...                     anti_aliasing_filter=NoFilter())
    >>> make_estimator("factorised", model, mask="truth")
    Traceback (most recent call last):
    vsep.errors.InputError: mask is 'truth'; factorised takes none; masked does.
    """
    if missing is not None:
        if not ESTIMATORS.require(name).takes_missing:
            raise InputError(
                f"{np.count_nonzero(missing)} samples of the frame are missing; {name} cannot "
                "leave samples out."
            )
        settings |= {"missing": missing}
    estimator: Estimator = ESTIMATORS.make(name, model=model, **settings)
    record = PARAMETERS["acceleration"]
    chosen = record.default if acceleration is None else acceleration
    require_choice("acceleration", chosen, tuple(record.choices or {}))
    if chosen == "neglected":
        return estimator
    if not isinstance(estimator, ObjectSettings):
        raise InputError(f"acceleration is {chosen!r}; {name} does not model it.")
    return AcceleratingSeparator(inner=estimator)
