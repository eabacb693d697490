"""Snapshot of a finished run as one HTML file or one PNG, without display, browser or network.

The HTML holds the views of the dashboard with all that they need; the PNG is drawn by matplotlib
from the same picture.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from bokeh.embed import file_html
from bokeh.models import Span
from bokeh.resources import INLINE

from app.assets import path
from app.backdrop import make_backdrop
from app.picture import Picture, make_picture
from app.print import write_png
from app.views.progress import ProgressView
from app.views.ramps import RampStrip
from app.views.range_doppler import RangeDopplerView
from app.views.signals import DelayView, FastTimeView
from app.views.style import Axis
from app.views.tables import log_html, table_html
from vsep._arrays import InputError
from vsep.files.frame import Frame
from vsep.inference.estimator import Estimator
from vsep.inference.run import iterate
from vsep.inference.state import Step
from vsep.signal.scene import Observation

WIDTH = 1088
SUFFIXES = (".html", ".png")


def write_report(
    frame: Frame, out: Path, *, separator: Estimator, settings: Mapping[str, str]
) -> None:
    """Separate a frame and write what the dashboard would show at the end.

    Parameters
    ----------
    frame : Frame
        The frame, with truth where it is known.
    out : Path
        File to write, ``.html`` or ``.png``.
    separator : Estimator
        Estimator with its settings.
    settings : mapping of str to str
        What the report lists: settings, seed.

    Raises
    ------
    InputError
        If the suffix is another one or the frame does not suit the estimator.
    OSError
        If the file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"The report {out.name!r} must end in .html or .png.")
    picture = final_picture(frame, separator)
    if suffix == ".png":
        write_png(picture, out, settings=settings)
    else:
        out.write_text(report_html(picture, settings=settings), encoding="utf-8")


def final_picture(frame: Frame, separator: Estimator) -> Picture:
    """Run the separator to its end and make the picture of the strongest burst's ramp."""
    backdrop = make_backdrop(
        frame.radar, Observation(received=frame.received, truth=frame.truth), title=frame.name
    )
    steps: list[Step] = list(iterate(separator, frame.received))
    energies = (abs(steps[-1].state.interference_signal) ** 2).sum(axis=1)
    return make_picture(
        backdrop, separator.init(frame.received), steps, ramp=int(energies.argmax())
    )


def report_html(picture: Picture, *, settings: Mapping[str, str]) -> str:
    """Return the report as one HTML document that asks for nothing else."""
    several = picture.backdrop.radar.num_ramps > 1
    range_axis, crosshair = Axis(), Span(dimension="height", line_color="#8C8C8C")
    fast_time, delay = FastTimeView(legend=True), DelayView(range_axis, crosshair, legend=True)
    maps, strip, progress = RangeDopplerView(range_axis, crosshair), RampStrip(), ProgressView()
    sized = [(fast_time.figure, WIDTH, 250), (delay.figure, WIDTH, 290)]
    sized += [
        (plot, 420, height) for plot, height in zip(progress.figures, (90, 90, 120), strict=True)
    ]
    if several:
        half = (WIDTH - 10) // 2
        sized += [(strip.figure, WIDTH, 64), (maps.before, half, 340), (maps.after, half, 340)]
    for plot, width, height in sized:
        plot.update(sizing_mode="fixed", width=width, height=height)
    for view in (delay, progress, fast_time, *((maps, strip) if several else ())):
        view.update(picture)
    document: str = file_html(
        [plot for plot, *_ in sized],
        resources=INLINE,
        title=f"vsep: {picture.backdrop.title}",
        template=path("report/report.html").read_text(encoding="utf-8"),
        template_variables={
            "heading": f"vsep: {picture.backdrop.title}",
            "outcome": outcome(picture),
            "levels": picture.backdrop.levels_text,
            "table": table_html(picture.table, moving=several),
            "log": log_html(picture.log),
            "settings": list(settings.items()),
        },
    )
    return document


def outcome(picture: Picture) -> str:
    """Say in one line how the run ended."""
    found, bursts = len(picture.objects.ranges_m), int(np.isfinite(picture.burst_level_db).sum())
    return (
        f"{picture.iteration} iterations, {picture.termination.value}. "
        f"{found} {'object' if found == 1 else 'objects'}, bursts in {bursts} of "
        f"{len(picture.true_ramps)} {'ramp' if len(picture.true_ramps) == 1 else 'ramps'}."
    )
