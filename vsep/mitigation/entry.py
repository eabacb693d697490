"""Record of a mitigation method, over which command line, forms, help and studies iterate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from vsep.mitigation.sparse.prior import PriorModel
from vsep.registry import Entry

TIME_DOMAIN = "Repair of interfered samples"
COMPRESSIVE_SENSING = "Compressive sensing"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MitigationEntry(Entry):
    """A mitigation method.

    It stands in the tuple ``ENTRIES`` of the method's own file, or another distribution declares it
    or the method's class as an entry point of ``vsep.mitigations``. The usual settings are
    ``domain`` and ``debias`` of compressive sensing, ``history``, and ``dither`` of what looks
    across the ramps.

    Parameters
    ----------
    name, factory, label, help, group, position
        As of `vsep.registry.Entry`; the factory makes a `vsep.mitigation.method.Mitigation`.
    prior : PriorModel, optional
        For a method with the setting ``history``: what sees the last frames for it.

    Examples
    --------
    >>> from vsep.mitigation.blanking import blanking
    >>> entry = MitigationEntry(name="blanking", factory=blanking)
    >>> entry.settings, entry.make(edge_samples=2).name
    (('edge_samples',), 'blanking')
    """

    kind: ClassVar[str] = "mitigation method"

    prior: PriorModel | None = None


def time_domain_entry(
    name: str, label: str, position: int, help: str, factory: Callable[..., Any]
) -> MitigationEntry:
    """Return the record of a method that repairs the interfered samples."""
    return MitigationEntry(
        name=name, label=label, help=help, factory=factory, group=TIME_DOMAIN, position=position
    )
