"""Registered names for the help of options, looked up only when it is printed.

``vsep --help`` loads no estimator. An option with such choices needs a ``metavar``; its help holds
``%(choices)s``.
"""

from collections.abc import Callable, Iterable, Iterator


class RegisteredNames:
    """Names for ``choices`` of argparse, of which any passes.

    The command refuses an unknown name itself: it knows why one that another distribution declares
    cannot be loaded.

    Parameters
    ----------
    load : callable
        Returns the names.
    """

    def __init__(self, load: Callable[[], Iterable[str]]) -> None:
        self._load = load

    def __contains__(self, _name: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(self._load())


def _estimators() -> Iterable[str]:
    from vsep.inference.registry import ESTIMATORS

    return ESTIMATORS


def _mitigations() -> Iterable[str]:
    from vsep.mitigation.registry import MITIGATIONS

    return MITIGATIONS


ESTIMATOR_NAMES = RegisteredNames(_estimators)
MITIGATION_NAMES = RegisteredNames(_mitigations)
