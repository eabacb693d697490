"""The mitigation methods by the names that users call them."""

from collections.abc import Callable
from inspect import signature
from typing import Any, Final, TypedDict, Unpack

from vsep.errors import InputError
from vsep.mitigation.autoregressive import autoregressive
from vsep.mitigation.blanking import blanking, zeroing
from vsep.mitigation.interpolation import linear, slow_time
from vsep.mitigation.mca import mca, mca_2d
from vsep.mitigation.method import Mitigation
from vsep.mitigation.noise_canceller import noise_canceller
from vsep.mitigation.sparse import sparse_methods as sparse
from vsep.mitigation.sparse.operators import Domain
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame

SPARSE: Final[dict[str, Callable[..., Mitigation]]] = {
    "ist": sparse.ist,
    "iht": sparse.iht,
    "iht-plain": sparse.iht_plain,
    "pm-ist": sparse.pm_ist,
    "pm-iht": sparse.pm_iht,
    "fista": sparse.fista,
    "omp": sparse.omp,
    "cosamp": sparse.cosamp,
    "amp": sparse.amp,
    "gamp": sparse.gamp,
    "yall1": sparse.yall1,
}
"""What makes each method of compressive sensing."""

MITIGATIONS: Final[dict[str, Callable[..., Mitigation]]] = {
    "zeroing": zeroing,
    "blanking": blanking,
    "linear": linear,
    "autoregressive": autoregressive,
    "slow-time": slow_time,
    "noise-canceller": noise_canceller,
    "mca": mca,
    "mca-2d": mca_2d,
    **SPARSE,
}
"""What makes each method; its keyword parameters are the settings that it has."""


PRIORS: Final[dict[str, PriorModel]] = {
    "pm-ist": sparse.SOFT_PRIOR,
    "pm-iht": sparse.HARD_PRIOR,
}
"""The methods that know the last frames of a sequence, and what sees these frames for them."""


class MitigationSettings(TypedDict, total=False):
    """Settings of the methods; what is left out keeps its default."""

    domain: Domain
    debias: bool
    history: tuple[SeenFrame, ...]


def make_mitigation(name: str, **settings: Unpack[MitigationSettings]) -> Mitigation:
    """Make the method of a name; settings that it does not have play no part.

    Parameters
    ----------
    name : str
        One of `MITIGATIONS`.
    **settings
        ``domain``: how the compressive-sensing methods compute, by two-dimensional masked residual
        updates ("masked-2d") or with the explicit matrix ("explicit-1d"). ``debias``: whether they
        end with a least-squares fit of the cells found. ``history``: what those of `PRIORS` have
        seen of the last frames.

    Raises
    ------
    InputError
        If the name is unknown or a setting out of its range.

    Examples
    --------
    >>> make_mitigation("zeroing", domain="masked-2d").name
    'zeroing'
    """
    if name not in MITIGATIONS:
        raise InputError(f"method is {name!r}; it must be one of {', '.join(MITIGATIONS)}.")
    factory = MITIGATIONS[name]
    known = signature(factory).parameters
    used: dict[str, Any] = {key: value for key, value in settings.items() if key in known}
    return factory(**used)
