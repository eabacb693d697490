"""Checks of values that a caller hands over."""

from collections.abc import Collection

from vsep.errors import InputError


def require_range(name: str, value: float, lowest: float, highest: float, unit: str = "") -> None:
    """Raise `InputError` unless ``lowest <= value <= highest``; NaN is never inside."""
    if not lowest <= value <= highest:
        suffix = f" {unit}" if unit else ""
        raise InputError(
            f"{name} is {value:g}{suffix}; it must lie between {lowest:g} and {highest:g}{suffix}."
        )


def require_choice(name: str, value: object, choices: Collection[str]) -> None:
    """Raise `InputError` unless a value is one of the choices."""
    if value not in choices:
        either = " or ".join(choices) if len(choices) == 2 else f"one of {', '.join(choices)}"
        raise InputError(f"{name} is {value!r}; it must be {either}.")
