"""A file of this machine, as its page and the workers know it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class StoredFile:
    """A file on this machine."""

    path: str  #: Where it is.
    name: str  #: What its owner calls it.
