"""Dropped files: which of them are settings, and what their text and a recording say together."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vsep.errors import InputError
from vsep.recordings.configurations.registry import SUFFIXES
from vsep.recordings.settings import MAX_FILE, RAW_FORMATS

_OF_ARRAYS = ("key", "axes")


def is_settings(name: str) -> bool:
    """Whether a file of a name is a configuration or settings, not a recording."""
    return Path(name).suffix.lower() in SUFFIXES


def text_of(name: str, content: bytes) -> str:
    """Return the text of a settings file; `InputError` if it is none."""
    try:
        return content[:MAX_FILE].decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{name} is no text in UTF-8; a settings file is needed.") from error


def completed(said: Mapping[Any, Any], suggested: Mapping[str, Any]) -> dict[Any, Any]:
    """Return what was said, completed by what the file says of itself.

    What belongs to a file of another kind is left out.
    """
    kinds = {said.get("format") or suggested["format"], suggested["format"]}
    same = len(kinds) == 1 or kinds <= set(RAW_FORMATS)
    foreign = () if same else ("format", *_OF_ARRAYS)
    kept = {key: value for key, value in said.items() if value is not None and key not in foreign}
    return {**suggested, **kept}
