"""Settings of a recording from a sensor's configuration, each number with its source."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from vsep.errors import InputError

_LARGEST = 1e15
ONE_CHIRP: Final = (
    "The sensor sends one chirp a frame: those of all frames in the file are taken for the ramps "
    "of one."
)


@dataclass(frozen=True, slots=True)
class Said:
    """A value and where it came from; whether it was said in the words of vsep itself."""

    value: Any
    source: str
    is_own: bool = False


@dataclass(frozen=True, slots=True)
class Configuration:
    """Settings of a recording as far as a configuration tells them.

    Parameters
    ----------
    settings : mapping of str to Said
        By the names of `RecordingSettings`, in units of the SI.
    remarks : tuple of str
        What contradicts itself, and what must be known beside.
    """

    settings: dict[str, Said]
    remarks: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, Any]:
        """The settings without their sources."""
        return {name: said.value for name, said in self.settings.items()}


@dataclass(frozen=True, slots=True)
class Reader:
    """A kind of configuration.

    Parameters
    ----------
    kind : str
        As sentences call it.
    recognises : callable
        Whether a text is of this kind, by its name and itself.
    read : callable
        Makes a `Configuration` of name and text; raises `InputError` if it cannot.
    """

    kind: str
    recognises: Callable[[str, str], bool]
    read: Callable[[str, str], Configuration]


def number(name: str, text: Any, what: str) -> float:
    """Read a number of a configuration.

    Raises `InputError` if it is none.
    """
    try:
        if isinstance(text, str) and text.strip().lower().startswith("0x"):
            value = float(int(text[:40], 16))
        else:
            value = float(text)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name}: {what} has {str(text)[:40]!r}; a number is needed.") from error
    if not abs(value) < _LARGEST:
        raise InputError(f"{name}: {what} has {value:g}; a number below {_LARGEST:g} is needed.")
    return value
