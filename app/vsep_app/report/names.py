"""Checks of the names and iterations of a report before anything is computed."""

import shutil
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from vsep.errors import InputError

REPORTS = (".html", ".png", ".pdf", ".json")
ANIMATIONS = (".gif", ".webp", ".mp4")
MAX_FRAMES = 6
"""Of a filmstrip."""


def require_report_name(out: str) -> None:
    """Refuse a name that no report has."""
    if Path(out).suffix.lower() not in REPORTS:
        raise InputError(f"The report {Path(out).name!r} must end in .html, .png, .pdf or .json.")


def require_record_name(out: str) -> None:
    """Refuse a name that no recorded run has."""
    if Path(out).suffix.lower() != ".html":
        raise InputError(f"The recorded run {Path(out).name!r} must end in .html.")


def require_animation_name(out: str) -> None:
    """Refuse a name that no animation has, and one that cannot be made on this machine."""
    suffix = Path(out).suffix.lower()
    if suffix not in ANIMATIONS:
        raise InputError(f"The animation {Path(out).name!r} must end in .gif, .webp or .mp4.")
    if suffix == ".mp4" and ffmpeg_program() is None:
        raise InputError(
            f"{Path(out).name} needs the program ffmpeg, which is not installed; choose .gif or "
            ".webp, or install the extra: pip install 'vsep[video]'."
        )


def ffmpeg_program() -> str | None:
    """Return the program that makes videos: the system's, else that of the extra ``video``."""
    found = shutil.which("ffmpeg")
    if found is None and find_spec("imageio_ffmpeg") is not None:
        found = str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    return found


def require_room(iterations: Sequence[int]) -> None:
    """Refuse a filmstrip with more frames than can be read."""
    if len(iterations) > MAX_FRAMES:
        raise InputError(
            f"A filmstrip of {len(iterations)} iterations is asked for; it has room for at most "
            f"{MAX_FRAMES}."
        )
