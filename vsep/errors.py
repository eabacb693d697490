"""Errors that a caller can mend."""


class InputError(ValueError):
    """What the caller handed over cannot be used; the message names the value and the range."""
