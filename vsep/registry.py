"""Registries of named choices: one record each, open to other distributions.

A choice (an estimator, a mitigation method) is one `Entry` that stands in the file of what it
makes, in the tuple ``ENTRIES``. A `Registry` collects those of a package of this library and what
other distributions declare as entry points; command line, forms, help and studies iterate over it.
"""

import pkgutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from importlib import import_module
from inspect import Parameter, getdoc, signature
from typing import Any, ClassVar, Generic, Self, TypeVar

from vsep._entry_points import load_entries, require_loadable
from vsep.errors import InputError, shown

LAST = 1000
_SELF_STANDING = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Entry:
    """A named choice.

    Parameters
    ----------
    name : str
        As users type it, and as it stands in rows and addresses.
    factory : callable
        Makes it: a class, a function of a module or a `functools.partial` of one, so that it can
        be pickled. Its keyword parameters are the settings that the choice has.
    label : str
        As forms print it; the name by default.
    help : str
        One sentence; the first line of the factory's docstring by default.
    group : str
        Heading under which it is listed.
    position : int
        Place in lists: lowest first, and by name where equal.
    """

    kind: ClassVar[str] = "choice"
    bound: ClassVar[tuple[str, ...]] = ()  # parameters that are no settings, such as the model

    name: str
    factory: Callable[..., Any]
    label: str = ""
    help: str = ""
    group: str = "Other"
    position: int = LAST

    def __post_init__(self) -> None:
        """Fill in label and help."""
        object.__setattr__(self, "label", self.label or self.name)
        object.__setattr__(self, "help", self.help or _first_line(self.factory))

    @property
    def defaults(self) -> dict[str, Any]:
        """Defaults of the settings that it has: the keyword parameters of its factory."""
        fixed = self.factory.keywords if isinstance(self.factory, partial) else {}
        return {
            name: parameter.default
            for name, parameter in signature(self.factory).parameters.items()
            if parameter.kind in _SELF_STANDING and name not in {*fixed, *self.bound}
        }

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the settings that it has."""
        return tuple(self.defaults)

    def accepted(self, **settings: Any) -> dict[str, Any]:
        """Return those of the settings that it has and that are given, which is not None.

        For a form that keeps one set of controls for several choices; `make` refuses the others.
        """
        return {
            name: value
            for name, value in settings.items()
            if value is not None and name in self.settings
        }

    def require_settings(
        self, settings: Mapping[str, Any], others: Iterable["Entry"] = ()
    ) -> dict[str, Any]:
        """Return the settings that are given, which is not None, if it has all of them.

        Parameters
        ----------
        settings : mapping
            Values by name.
        others : iterable of Entry
            Other choices, to be named where they have a setting that this one lacks.

        Raises
        ------
        InputError
            If it lacks one.
        """
        given = {name: value for name, value in settings.items() if value is not None}
        for name, value in given.items():
            if name not in (*self.settings, *self.bound):
                takers = [entry.name for entry in others if name in entry.settings]
                raise InputError(_refusal(self, name, value, takers))
        return given

    def make(self, **settings: Any) -> Any:
        """Make it with these settings; None stands for the default.

        Raises
        ------
        InputError
            If it has no such setting, or a value is out of its range.
        """
        return self.factory(**self.require_settings(settings))

    @classmethod
    def of(cls, given: Any, name: str | None = None) -> Self:
        """Return the record of what was handed over: itself, or one made of a class or function.

        Raises
        ------
        InputError
            If it is neither.
        """
        if isinstance(given, cls):
            return given if name is None else replace(given, name=name)
        if isinstance(given, Entry) or not callable(given):
            raise InputError(
                f"{given!r} is no {cls.kind}; it must be a class, a function that makes one, or "
                f"{'an' if cls.__name__[0] in 'AEIO' else 'a'} {cls.__name__}."
            )
        own: str = getattr(given, "__name__", "unnamed")
        return cls(name=own if name is None else name, factory=given)


E_co = TypeVar("E_co", bound=Entry, covariant=True)


class Registry(Mapping[str, E_co], Generic[E_co]):
    """Entries by name, in the order in which they are listed.

    Those of this library are found in the modules of a package at the first use. An entry point of
    another distribution that cannot be loaded is left out; `require` says why.

    Parameters
    ----------
    kind : type
        The class of the entries.
    package : str
        Where the modules with ``ENTRIES`` are.
    group : str
        Of the entry points.
    """

    def __init__(self, kind: type[E_co], package: str, group: str) -> None:
        self._kind, self._package, self._group = kind, package, group

    def __getitem__(self, name: str) -> E_co:
        return self._entries()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries())

    def __len__(self) -> int:
        return len(self._entries())

    def require(self, name: str) -> E_co:
        """Return the entry of a name.

        Raises
        ------
        InputError
            If there is none, or it comes from another distribution and cannot be loaded.
        """
        entries = self._entries()
        if name not in entries:
            require_loadable(self._group, name)
            if name in load_entries(self._group):
                self._kind.of(load_entries(self._group)[name], name)  # says what it is not
            raise InputError(
                f"{self._kind.kind} is {shown(name)}; it must be one of {', '.join(entries)}."
            )
        return entries[name]

    def make(self, name: str, **settings: Any) -> Any:
        """Make the choice of a name; a setting that it does not have is refused.

        Raises
        ------
        InputError
            If the name is unknown, the choice has no such setting or a value is out of its range.
        """
        return self.require(name).factory(**self.require_settings(name, settings))

    def require_settings(self, name: str, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Return the settings that are given, which is not None, if a choice has all of them.

        Raises
        ------
        InputError
            If the name is unknown or the choice lacks one; the sentence says which ones have it.
        """
        return self.require(name).require_settings(settings, self.values())

    @property
    def settings(self) -> frozenset[str]:
        """Names of the settings that at least one of them has."""
        return frozenset(name for entry in self.values() for name in entry.settings)

    def in_group(self, group: str) -> tuple[str, ...]:
        """Return the names of the entries of a group."""
        return tuple(name for name, entry in self.items() if entry.group == group)

    def _entries(self) -> dict[str, E_co]:
        entries = {**self._foreign(), **self._own}
        return dict(sorted(entries.items(), key=lambda item: (item[1].position, item[0])))

    @cached_property
    def _own(self) -> dict[str, E_co]:
        package = import_module(self._package)
        modules = pkgutil.walk_packages(package.__path__, f"{self._package}.")
        entries = [
            entry
            for module in modules
            for entry in getattr(import_module(module.name), "ENTRIES", ())
        ]
        return {entry.name: entry for entry in entries}

    def _foreign(self) -> dict[str, E_co]:
        entries: dict[str, Any] = {}
        for name, given in load_entries(self._group).items():
            try:
                entries[name] = self._kind.of(given, name)
            except InputError:
                continue
        return entries


def _refusal(entry: Entry, name: str, value: Any, takers: list[str]) -> str:
    sentence = f"{name} is {shown(value)}; {entry.name} takes none"
    if not takers:
        return f"{sentence}; its settings are {', '.join(entry.settings) or 'none at all'}."
    if len(takers) == 1:
        return f"{sentence}; {takers[0]} does."
    return f"{sentence}; {', '.join(takers[:-1])} and {takers[-1]} do."


def _first_line(factory: Callable[..., Any]) -> str:
    origin = factory.func if isinstance(factory, partial) else factory
    return (getdoc(origin) or "").strip().partition("\n")[0]
