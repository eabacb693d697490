"""Record of one setting: its words, unit, bounds and default."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from vsep._validation import require_range

Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True, slots=True)
class Parameter:
    """One setting: its words, unit, bounds and default.

    Values, bounds and ranges are in `unit`; `scale` converts them to SI units.

    Attributes
    ----------
    name : str
        As programs spell it.
    title, unit, convention : str
        For a reader; the convention stands behind the unit in a form: "dB, total".
    help : str
        One or two sentences.
    default : object
        A number, a truth value or the name of a choice.
    bounds : (float, float)
        What is allowed at all.
    span : (float, float), optional
        What a form, a link and a new axis offer; all that is allowed by default.
    step, scale : float
        Step of a slider, and how many SI units the unit is.
    digits : str
        Format of a slider's value, where the usual one is too short.
    values : tuple of float
        Those that a slider offers, where they are few.
    choices : mapping of str to str
        Names and labels, where the value is one of them.
    typed : bool
        Whether a form has a field for it, not a slider.
    optional : bool
        Whether None is allowed; then the default is None.
    query : str
        Name in an address; that of the setting by default.
    option : str
        Keyword of `vsep.simulate_preset` that takes a setting of the scene, in SI units; its name
        by default.
    of_recording, of_bursts : bool
        Whether it means something for a recorded frame, and whether only with interference.
    """

    name: str
    title: str
    help: str
    default: Any = None
    unit: str = ""
    convention: str = ""
    bounds: Range = (-inf, inf)
    span: Range | None = None
    step: float = 1.0
    scale: float = 1.0
    digits: str = ""
    values: tuple[float, ...] = ()
    choices: Mapping[str, str] | None = None
    typed: bool = False
    optional: bool = False
    query: str = ""
    option: str = ""
    of_recording: bool = True
    of_bursts: bool = False

    @property
    def label(self) -> str:
        """Title with unit, for an axis."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    @property
    def form_label(self) -> str:
        """Title with unit and convention, for a form."""
        return self.label.replace("]", f", {self.convention}]") if self.convention else self.label

    @property
    def key(self) -> str:
        """Name in an address."""
        return self.query or self.name

    @property
    def whole(self) -> bool:
        """Whether values are whole numbers."""
        return isinstance(self.default, int) and not isinstance(self.default, bool)

    @property
    def offered(self) -> Range:
        """What a form and a link offer, in `unit`."""
        return self.span or self.bounds

    def in_si(self, value: Any) -> Any:
        """Return a value in SI units; what has no unit stays as it is.

        Examples
        --------
        >>> Parameter(name="slope", title="Slope", help="", scale=1e12).in_si(9.2)
        9200000000000.0
        """
        return value if self.scale == 1.0 else value * self.scale

    def rounded_si(self, value: float) -> float:
        """Return a value in SI units, to twelve digits, as -250 ns are -2.5e-07 s."""
        return value if self.scale == 1.0 else float(f"{value * self.scale:.12g}")

    def shown(self, value_si: float) -> float:
        """Return a value in `unit`, to twelve digits."""
        return float(f"{value_si / self.scale:.12g}")

    def require(self, value_si: float, name: str = "", unit: str = "") -> None:
        """Raise `InputError` unless a value in SI units lies within the bounds.

        Parameters
        ----------
        value_si : float
            The value.
        name, unit : str
            What the message calls them; by default as a form does.
        """
        unit = unit or (self.unit if self.scale == 1.0 else "")
        lowest, highest = map(self.rounded_si, self.bounds)
        require_range(name or self.title, value_si, lowest, highest, unit)
