"""Reports of many frames in a folder, and one page that lists them all."""

import base64
import io
import os
from collections import Counter
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

import matplotlib as mpl
import numpy as np
from PIL import Image

from vsep.errors import InputError
from vsep.files.writing import write_text
from vsep_app.assets import path
from vsep_app.model.picture import Picture
from vsep_app.report.page import outcome
from vsep_app.report.run import execute, provenance
from vsep_app.report.spec import ReportSpec
from vsep_app.report.write import write_report
from vsep_app.views.tables import MISSING, row_html

INDEX = "index.html"
_HEAD = ("frame", "map, bursts cancelled", "outcome", "objects", "true", "misses", "false alarms")


def write_batch(
    frames: Sequence[str], folder: Path, *, spec_of: Callable[[str], ReportSpec]
) -> list[str]:
    """Write a report of every frame and the page that lists them.

    Parameters
    ----------
    frames : sequence of str
        Frame files; their names without suffix must differ.
    folder : Path
        Made if need be.
    spec_of : callable
        Frame file to spec.

    Returns
    -------
    list of str
        A sentence for every frame that could not be used; it is in the list, too.

    Raises
    ------
    InputError
        If two reports would have one name, or the folder is none.
    OSError
        If something cannot be written.
    """
    _require_distinct(frames, folder)
    folder.mkdir(parents=True, exist_ok=True)
    rows, errors = [], []
    for frame in frames:
        try:
            rows.append(_report(frame, folder / f"{Path(frame).stem}.html", spec_of(frame)))
        except InputError as error:
            errors.append(str(error))
            rows.append(row_html([escape(frame), MISSING, escape(str(error)), *[MISSING] * 4]))
    head = "".join(f"<th>{name}</th>" for name in _HEAD)
    style = path("report/report.css").read_text(encoding="utf-8")
    count = f"{len(frames) - len(errors)} of {len(frames)} frames"
    html = (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>vsep: {count}</title>'
        f"<style>\n{style}</style></head><body><h1>vsep: {count}</h1>\n"
        f'<table class="settings"><thead><tr>{head}</tr></thead><tbody>\n'
        + "\n".join(rows)
        + "\n</tbody></table></body></html>\n"
    )
    write_text(folder / INDEX, html)
    return errors


def _require_distinct(frames: Sequence[str], folder: Path) -> None:
    counts = Counter(Path(frame).stem for frame in frames)
    name, count = counts.most_common(1)[0]
    if count > 1:
        raise InputError(
            f"{count} frames are named {name}; reports of a folder need distinct ones."
        )
    if Path(INDEX).stem in counts:
        raise InputError(
            f"A frame is named {Path(INDEX).stem}, as the page that lists all reports."
        )
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder} is a file; several frames need a folder.")


def _report(frame: str, out: Path, spec: ReportSpec) -> str:
    """Write one report and return its row of the list."""
    run = execute(spec)
    write_report(run, out)
    picture = run.picture()
    metrics = provenance(run)["metrics"] or {}
    numbers = [str(len(picture.objects.ranges_m))]
    numbers += [
        str(metrics.get(key, MISSING)) for key in ("objects_true", "misses", "false_alarms")
    ]
    # In an address a name that is no UTF-8 stands by its bytes.
    link = f'<a href="{quote(os.fsencode(out.name))}">{escape(frame)}</a>'
    return row_html([link, _thumbnail(picture), escape(outcome(picture)), *numbers])


def _thumbnail(picture: Picture) -> str:
    """Return the map after cancellation as an image element."""
    colours = (mpl.colormaps["viridis"](np.arange(256))[:, :3] * 255.0).astype(np.uint8)
    image = Image.fromarray(colours[picture.map_after[::-1]])
    file = io.BytesIO()
    image.resize((240, 80)).save(file, format="PNG")
    data = base64.b64encode(file.getvalue()).decode()
    return f'<img width="240" height="80" alt="" src="data:image/png;base64,{data}">'
