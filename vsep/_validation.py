"""Checks of values that a caller hands over."""

from vsep.errors import InputError


def require_range(name: str, value: float, lowest: float, highest: float, unit: str = "") -> None:
    """Raise `InputError` unless ``lowest <= value <= highest``; NaN is never inside."""
    if not lowest <= value <= highest:
        suffix = f" {unit}" if unit else ""
        raise InputError(
            f"{name} is {value:g}{suffix}; it must lie between {lowest:g} and {highest:g}{suffix}."
        )
