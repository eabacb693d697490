"""Provenance of a report inside its file: HTML, PNG, PDF or JSON."""

import base64
import binascii
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PIL import Image, UnidentifiedImageError

from vsep.errors import InputError
from vsep.files.results import as_json

# This name stays: reports of all versions are read back.
ELEMENT = "vsep-account"
PNG_KEY = "vsep"
_PDF_MARK = "vsep:"
_MAX_FILE = 256 * 2**20
_IN_HTML = re.compile(rf'<script type="application/json" id="{ELEMENT}">(.*?)</script>', re.DOTALL)
_IN_PDF = re.compile(rb"/Keywords\s*\(" + _PDF_MARK.encode() + rb"([A-Za-z0-9+/=]*)\)")
_IMAGE_HEADS = (b"\x89PNG", b"GIF8", b"RIFF")


def for_html(provenance: Mapping[str, Any]) -> str:
    """Return the element of a page that holds provenance."""
    text = as_json(provenance).replace("<", "\\u003c")
    return f'<script type="application/json" id="{ELEMENT}">{text}</script>'


def for_pdf(provenance: Mapping[str, Any]) -> str:
    """Return the keywords of a document that hold provenance: letters that need no escape."""
    return _PDF_MARK + base64.b64encode(as_json(provenance).encode()).decode()


def read_provenance(path: str | Path) -> dict[str, Any]:
    """Read what a report says of itself.

    Parameters
    ----------
    path : str or Path
        A page, a picture (PNG, GIF, WebP), a PDF document or a result file.

    Raises
    ------
    InputError
        If it says nothing, or is no report at all.
    OSError
        If it cannot be read.
    """
    file = Path(path)
    if file.stat().st_size > _MAX_FILE:
        raise InputError(f"{path} is larger than any report; give a report of this program.")
    try:
        data = json.loads(_text(file, file.read_bytes()))
    except (ValueError, RecursionError, binascii.Error, UnidentifiedImageError, OSError) as error:
        raise InputError(
            f"{path} does not say how it was made; give a report of this program."
        ) from error
    if not isinstance(data, dict) or "spec" not in data:
        raise InputError(f"{path} does not say how it was made; give a report of this program.")
    return data


def _text(file: Path, content: bytes) -> str:
    """Return the JSON in a file; ValueError if there is none."""
    if content.startswith(_IMAGE_HEADS):
        return _image_text(file)
    if content.startswith(b"%PDF"):
        keywords = _IN_PDF.search(content)
        if keywords is None:
            raise ValueError("no keywords")
        return base64.b64decode(keywords.group(1), validate=True).decode()
    text = content.decode("utf-8")
    if text.lstrip().startswith("{"):
        return text
    element = _IN_HTML.search(text)
    if element is None:
        raise ValueError("no provenance in the page")
    return element.group(1)


def _image_text(file: Path) -> str:
    with Image.open(file, formats=("PNG", "GIF", "WEBP")) as image:
        held = [image.info.get(key) for key in (PNG_KEY, "comment", "xmp")]
    text = next((each for each in held if each), "")
    return text.decode("utf-8") if isinstance(text, bytes) else str(text)
