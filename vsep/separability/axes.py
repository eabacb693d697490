"""The parameters a map can have as its axes: their names, ranges and units."""

import math
from dataclasses import dataclass

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_choice, require_range
from vsep.errors import InputError, shown
from vsep.parameters import MAX_OBJECTS, PARAMETERS
from vsep.parameters.record import Parameter

MAX_VALUES = 129
_MIN_SLOPE_HZ_PER_S = 1e9  # of a slope difference: the burst lasts for hundreds of ramps


AXES: dict[str, Parameter] = {
    kind.name: kind
    for kind in (
        PARAMETERS["sir_db"],
        PARAMETERS["snr_db"],
        Parameter(
            name="slope_difference_hz_per_s",
            title="slope difference",
            help="Slope difference (burst length)",
            unit="MHz/µs",
            scale=1e12,
            bounds=(-5.0, 5.0),
            span=(-2.0, -0.1),
            step=0.01,
        ),
        Parameter(
            name="object_delay_s",
            title="object delay from the burst's middle",
            help="Object delay, from the burst's middle",
            unit="ns",
            scale=1e-9,
            bounds=(-1000.0, 1000.0),
            span=(-250.0, 250.0),
        ),
        Parameter(
            name="num_objects",
            title="objects",
            help="Number of objects",
            default=1,
            bounds=(1, MAX_OBJECTS),
            span=(1, 20),
        ),
        Parameter(
            name="interfered_share",
            title="share of interfered ramps",
            help="Share of interfered ramps",
            bounds=(0.0, 1.0),
            span=(0.0625, 1.0),
            step=0.0625,
        ),
        Parameter(
            name="filter_cutoff_hz",
            title="filter cutoff",
            help="Filter bandwidth",
            unit="MHz",
            scale=1e6,
            bounds=(0.01, 10.0),
            span=(0.4, 2.4),
            step=0.005,
        ),
        Parameter(
            name="filter_mismatch",
            title="assumed over true cutoff - 1",
            help="Filter mismatch",
            bounds=(-0.9, 2.0),
            span=(-0.3, 0.3),
            step=0.01,
        ),
    )
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Axis:
    """An axis of a map: equally spaced values of one parameter.

    Raises `InputError` if the name is unknown or a value not allowed.

    Examples
    --------
    >>> Axis(name="sir_db", start=-10.0, stop=10.0, count=3).values
    array([-10.,   0.,  10.])
    """

    name: str  #: one of `AXES`
    #: first and last value, in SI units
    start: float
    stop: float
    count: int  #: number of values, 2 to `MAX_VALUES`

    def __post_init__(self) -> None:
        """Check name, ends and number of values."""
        require_known(self.name)
        require_range(f"Number of values of {self.name}", self.count, 2, MAX_VALUES)
        for value in (self.start, self.stop):
            require_allowed(self.name, value)
        if self.start >= self.stop:
            raise InputError(
                f"{self.name} goes from {self.start:g} to {self.stop:g}; the first must be smaller."
            )
        for value in self.values.tolist():
            require_allowed(self.name, value)

    @property
    def kind(self) -> Parameter:
        """Label, range and unit."""
        return AXES[self.name]

    @property
    def values(self) -> FloatArray:
        """(count,) values; twelve digits, so that 0.1 steps read as such."""
        values = np.linspace(self.start, self.stop, self.count).tolist()
        return np.array([float(f"{value:.12g}") for value in values])

    @property
    def text(self) -> str:
        """The axis as `parse_axis` reads it."""
        return f"{self.name}={self.start:.12g}:{self.stop:.12g}:{self.count}"


def parse_axis(text: str) -> Axis:
    """Read an axis such as ``sir_db=-40:40:33``; a name may lack its unit.

    Raises `InputError` if it does not read so, or a value is not allowed.

    Examples
    --------
    >>> parse_axis("slope_difference=-2e12:-1e11:20").name
    'slope_difference_hz_per_s'
    """
    name, _, span = text.partition("=")
    parts = span.split(":")
    try:
        start, stop = float(parts[0]), float(parts[1])
        count = int(parts[2])
        whole = len(parts) == 3
    except (ValueError, IndexError):
        whole = False
    if not whole:
        raise InputError(f"The axis is {shown(text)}; it must read name=start:stop:count.")
    return Axis(name=full_name(name.strip()), start=start, stop=stop, count=count)


def parse_value(text: str) -> tuple[str, float]:
    """Read a fixed value such as ``snr_db=40``; a name may lack its unit.

    Raises `InputError` if it does not read so, or the value is not allowed.
    """
    name, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        raise InputError(f"The value is {shown(text)}; it must read name=number.") from None
    name = full_name(name.strip())
    require_allowed(name, value)
    return name, value


def full_name(name: str) -> str:
    """Return the name of a parameter, its unit added if it lacks.

    Raises `InputError` if there is none of that name.
    """
    found = [known for known in AXES if known == name or _without_unit(known) == name]
    return require_known(found[0] if found else name)


def require_known(name: str) -> str:
    """Return the name of a parameter; `InputError` if there is none of that name."""
    require_choice("The parameter", name, AXES)
    return name


def require_allowed(name: str, value: float) -> None:
    """Raise `InputError` unless a parameter may have a value."""
    kind = AXES[name]
    kind.require(value, name)
    if kind.whole and not float(value).is_integer():
        raise InputError(f"{name} is {value:g}; its values must be whole numbers.")
    if name == "slope_difference_hz_per_s" and abs(value) < _MIN_SLOPE_HZ_PER_S:
        raise InputError(
            f"{name} is {value:g}; it must be at least {_MIN_SLOPE_HZ_PER_S:g} away from 0, "
            "where chirps are parallel and there is no burst."
        )
    if name == "interfered_share" and not math.copysign(1.0, value) * value > 0.0:
        raise InputError(f"{name} is {value:g}; it must be above 0.")


def _without_unit(name: str) -> str:
    """Return a name without its unit.

    Examples
    --------
    >>> _without_unit("slope_difference_hz_per_s"), _without_unit("num_objects")
    ('slope_difference', 'num_objects')
    """
    for unit in ("_hz_per_s", "_db", "_hz", "_s"):
        if name.endswith(unit) and name != "num_objects":
            return name.removesuffix(unit)
    return name
