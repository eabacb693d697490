"""Page of a reproduction: claimed, measured, interval, verdict, and the figures."""

import os
import platform
from base64 import b64encode
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

from PIL import Image

from vsep._version import __version__
from vsep.reproduction.claims import Finding
from vsep.reproduction.figures import FIGURES
from vsep.reproduction.table import HEADINGS, cells_of, command_of
from vsep_app.figures.document import page_html
from vsep_app.report.run import versions

_COLOURS = 96
_LOOKS = {"reproduced": "reproduced", "not reproduced": "contradicted"}


def machine_text() -> str:
    """Say when, with what and where, in one sentence."""
    libraries = ", ".join(f"{name} {number}" for name, number in versions().items() if number)
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return f"{datetime.now(UTC).date().isoformat()}; {libraries}; {machine}."


def reproduction_html(
    findings: Sequence[Finding], pictures: Mapping[str, Path], *, made: str, machine: str
) -> str:
    """Return one page that asks for nothing else.

    Parameters
    ----------
    findings : sequence of Finding
        Claims with what was measured.
    pictures : mapping
        PNG files by figure; those that are there are put into the page.
    made, machine : str
        How and where.
    """
    sections = []
    for name, figure in FIGURES.items():
        own = [finding for finding in findings if finding.claim.figure == name]
        picture = pictures.get(name)
        if own or picture is not None:
            sections.append(
                {
                    "heading": f"{figure.source}: {name}, {figure.title}",
                    "command": command_of(name),
                    "rows": [
                        {"cells": cells_of(each), "look": _LOOKS.get(each.verdict, "")}
                        for each in own
                    ],
                    "picture": _encoded(picture),
                }
            )
    title = f"vsep {__version__}: what the papers claim and what is measured"
    return page_html(
        "reproduction.html",
        title=title,
        made=made,
        machine=machine,
        headings=HEADINGS,
        sections=sections,
    )


def _encoded(picture: Path | None) -> str:
    """Return a picture as text, of fewer colours: a fourth of its bytes."""
    if picture is None or not picture.exists():
        return ""
    content = BytesIO()
    with Image.open(picture) as image:
        image.convert("RGB").quantize(_COLOURS).save(content, format="PNG", optimize=True)
    return b64encode(content.getvalue()).decode("ascii")
