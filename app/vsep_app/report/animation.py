"""Animations of a run: GIF, WebP or, with ffmpeg, MP4."""

import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from vsep.errors import InputError
from vsep.files.results import as_json
from vsep.files.writing import written_beside
from vsep_app.figures.figure_page import draw_delay, draw_fast_time, draw_map
from vsep_app.model.picture import Picture
from vsep_app.report.names import ffmpeg_program, require_animation_name
from vsep_app.report.replay import status
from vsep_app.report.run import ReportRun, provenance
from vsep_app.views.style import COLOURS

SIZE_INCHES = (9.6, 5.6)
DOTS_PER_INCH = 100
FIRST_MS, EACH_MS, LAST_MS = 1000, 400, 3000
MAX_PICTURES = 60
"""Of a longer run every second, third, ... iteration is shown."""
WEBP_QUALITY = 80
VIDEO_RATE = 10  # frames a second; all times above are whole frames of it


def write_animation(run: ReportRun, out: Path) -> None:
    """Write all iterations of a run as a moving picture; the last one is held.

    Raises `InputError` if the name has another suffix, or ffmpeg is needed and missing. Raises
    `OSError` if the file cannot be written.
    """
    require_animation_name(str(out))
    images = [draw_image(run.picture(i), len(run.steps)) for i in shown_iterations(len(run.steps))]
    times_ms = [FIRST_MS, *[EACH_MS] * (len(images) - 2), LAST_MS][: len(images)]
    with written_beside(out) as beside:
        _WRITERS[out.suffix.lower()](beside, images, times_ms, as_json(provenance(run)).encode())


def shown_iterations(last: int) -> list[int]:
    """Return the iterations that an animation shows, the first and the last among them.

    Examples
    --------
    >>> shown_iterations(3), len(shown_iterations(500)), shown_iterations(500)[-1]
    ([0, 1, 2, 3], 57, 500)
    """
    stride = -(-(last + 1) // MAX_PICTURES)
    return sorted({*range(0, last + 1, stride), last})


def draw_image(picture: Picture, last: int) -> Image.Image:
    """Draw one iteration of a run of `last` iterations."""
    page = Figure(figsize=SIZE_INCHES, dpi=DOTS_PER_INCH)
    canvas = FigureCanvasAgg(page)
    several = picture.static_picture.radar.num_ramps > 1
    edges = {"left": 0.06, "right": 0.985, "top": 0.88, "bottom": 0.125}
    widths = (1.25, 1.0) if several else (1.0,)
    grid = page.add_gridspec(2, len(widths), width_ratios=widths, hspace=0.42, wspace=0.17, **edges)
    top = page.add_subplot(grid[0, 0])
    draw_fast_time(top, picture, legend=False)
    draw_delay(page.add_subplot(grid[1, 0]), picture, legend=False)
    if several:
        for row, before in enumerate((True, False)):
            axes = page.add_subplot(grid[row, 1])
            draw_map(axes, picture, before=before)
            axes.set_ylabel("velocity [m/s]", fontsize=8)
    handles, labels = top.get_legend_handles_labels()
    page.legend(handles, labels, loc="lower center", ncols=len(labels), fontsize=9, frameon=False)
    words = status(picture, last)
    page.text(0.015, 0.955, words[0].upper() + words[1:], fontsize=12, weight="bold", va="center")
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])


def animation_palette() -> "np.ndarray[tuple[int, int], np.dtype[np.uint8]]":
    """Return (256, 3) colours that all pictures are made of: maps, lines and their edges, greys.

    A palette found from the pictures' pixels would give nearly all of it to the maps and paint
    thin lines in each other's colours.
    """
    map_colours = mpl.colormaps["viridis"](np.linspace(0.0, 1.0, 152))[:, :3]
    blends = np.linspace(0.2, 1.0, 16)[:, None]
    lines = [1.0 + blends * (np.array(to_rgb(colour)) - 1.0) for colour in COLOURS.values()]
    greys = np.linspace(0.0, 1.0, 24)[:, None] * np.ones(3)
    return np.asarray(np.round(255.0 * np.concatenate([map_colours, *lines, greys])), np.uint8)


def _write_gif(
    out: Path, images: Sequence[Image.Image], times_ms: Sequence[int], provenance: bytes
) -> None:
    # One palette for all: then a picture holds only what differs from the one before.
    palette = Image.new("P", (1, 1))
    palette.putpalette(animation_palette().tobytes())
    first, *others = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    _save([first, *others], out, times_ms, format="GIF", optimize=True, comment=provenance)


def _write_webp(
    out: Path, images: Sequence[Image.Image], times_ms: Sequence[int], provenance: bytes
) -> None:
    _save(images, out, times_ms, format="WEBP", quality=WEBP_QUALITY, xmp=provenance)


def _save(images: Sequence[Image.Image], out: Path, times_ms: Sequence[int], **look: Any) -> None:
    first, *others = images
    first.save(out, save_all=True, append_images=others, duration=list(times_ms), loop=0, **look)


def _write_mp4(
    out: Path, images: Sequence[Image.Image], times_ms: Sequence[int], _account: bytes
) -> None:
    width, height = images[0].size
    source = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {VIDEO_RATE} -i -"
    target = "-pix_fmt yuv420p -movflags +faststart"
    options = f"-loglevel error -y {source} {target}".split()
    command = [ffmpeg_program() or "ffmpeg", *options, str(out)]
    raw = b"".join(
        image.tobytes() * (time_ms * VIDEO_RATE // 1000)
        for image, time_ms in zip(images, times_ms, strict=True)
    )
    done = subprocess.run(command, input=raw, capture_output=True, check=False)
    if done.returncode != 0:
        reason = done.stderr.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise InputError(f"ffmpeg could not write the animation: {reason[-1]}")


_WRITERS: dict[str, Callable[[Path, Sequence[Image.Image], Sequence[int], bytes], None]] = {
    ".gif": _write_gif,
    ".webp": _write_webp,
    ".mp4": _write_mp4,
}
