"""Registry of the mitigation methods."""

from typing import Any, Final

from vsep.mitigation.entry import MitigationEntry
from vsep.mitigation.method import Mitigation
from vsep.registry import Registry

MITIGATIONS: Final = Registry(MitigationEntry, "vsep.mitigation", "vsep.mitigations")
"""The methods of this package and of other distributions by name."""


def make_mitigation(name: str, **settings: Any) -> Mitigation:
    """Make the mitigation method of a name.

    Parameters
    ----------
    name : str
        One of `MITIGATIONS`.
    **settings
        Those that the method has, see `MitigationEntry.settings`; None stands for the default.
        ``domain``: how the compressive-sensing methods compute, by two-dimensional masked residual
        updates ("masked-2d") or with the explicit matrix ("explicit-1d"). ``debias``: whether they
        end with a least-squares fit of the cells found. ``history``: what the prior of pm-ist and
        pm-iht has seen of the last frames. ``dither``: how the ramps were dithered, for the methods
        that look across them; see `vsep.signal.radar.ChirpSequence.dither`.

    Raises
    ------
    InputError
        If the name is unknown, the method has no such setting or a value is out of its range.

    Examples
    --------
    >>> make_mitigation("ist", domain="explicit-1d").name
    'ist'
    >>> make_mitigation("zeroing", debias=True)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    vsep.errors.InputError: debias is True; zeroing takes none; ist, iht, ... do.
    """
    method: Mitigation = MITIGATIONS.make(name, **settings)
    return method
