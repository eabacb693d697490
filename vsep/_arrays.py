"""Array types and the few checks that every module shares."""

import math
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

ComplexArray: TypeAlias = NDArray[np.complex128]
FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
_Scalar = TypeVar("_Scalar", bound=np.generic)


class InputError(ValueError):
    """What the caller handed over cannot be used; the message names the value and the range."""


def frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    """Return a read-only view of `array`, copied first when it is a view of writable memory.

    Examples
    --------
    >>> import numpy as np
    >>> frozen(np.zeros(2)).flags.writeable
    False
    """
    if array.flags.writeable:
        array = array.copy() if array.base is not None else array
        array.flags.writeable = False
    return array


def wrap_frequency(frequency: FloatArray) -> FloatArray:
    """Wrap a normalised frequency (cycles per sample or per ramp) into [-1/2, 1/2).

    Examples
    --------
    >>> import numpy as np
    >>> wrap_frequency(np.array([0.5, 0.75, -0.5, 0.25]))
    array([-0.5 , -0.25, -0.5 ,  0.25])
    """
    wrapped: FloatArray = (frequency + 0.5) % 1.0 - 0.5
    return wrapped


def to_db(power_ratio: Any) -> Any:
    """Return 10 log10 of a power ratio; zero and below map to -400 dB instead of -inf."""
    if isinstance(power_ratio, float):  # one of the many of a step
        return 10.0 * math.log10(max(power_ratio, 1e-40))
    return 10.0 * np.log10(np.maximum(power_ratio, 1e-40))


def from_db(level_db: Any) -> Any:
    """Return the power ratio of a level in dB."""
    if isinstance(level_db, float):
        return 10.0 ** (level_db / 10.0)
    return 10.0 ** (np.asarray(level_db, dtype=np.float64) / 10.0)


def require_range(name: str, value: float, lowest: float, highest: float, unit: str = "") -> None:
    """Raise `InputError` unless ``lowest <= value <= highest``; NaN is never inside."""
    if not lowest <= value <= highest:
        suffix = f" {unit}" if unit else ""
        raise InputError(
            f"{name} is {value:g}{suffix}; it must lie between {lowest:g} and {highest:g}{suffix}."
        )
