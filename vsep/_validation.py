"""Checks of values that a caller hands over."""

from collections.abc import Collection

from vsep.errors import InputError, shown


def require_range(name: str, value: float, lowest: float, highest: float, unit: str = "") -> None:
    """Raise `InputError` unless ``lowest <= value <= highest``; NaN is never inside."""
    if not lowest <= value <= highest:
        suffix = f" {unit}" if unit else ""
        # An integer may be larger than all floating-point numbers.
        given = f"{value:g}" if not abs(value) >= 1e308 else shown(value)
        raise InputError(
            f"{name} is {given}{suffix}; it must lie between {lowest:g} and {highest:g}{suffix}."
        )


def require_choice(name: str, value: object, choices: Collection[str]) -> None:
    """Raise `InputError` unless a value is one of the choices."""
    if not isinstance(value, str) or value not in choices:
        either = " or ".join(choices) if len(choices) == 2 else f"one of {', '.join(choices)}"
        raise InputError(f"{name} is {shown(value)}; it must be {either}.")
