"""Views of the street: maps before and after, tracks with names, the time of every frame."""

from html import escape
from typing import Any

from bokeh.models import ColumnDataSource, CrosshairTool, LinearColorMapper, Span
from bokeh.plotting import figure

from vsep.signal.motion import CYCLE_S
from vsep_app.jobs.stream_loop import Punctuality
from vsep_app.pages.street.tasks import (
    MAP_LIMITS_DB,
    RANGES_M,
    VELOCITIES_MPS,
    StreetPicture,
    TrackRow,
)
from vsep_app.views.range_doppler import add_colour_bar, empty_image, image_box, map_figure
from vsep_app.views.style import (
    COLOURS,
    LABEL_SIZE,
    MAP_PALETTE,
    Axis,
    crosshair,
    plain_figure,
    put,
    short,
)
from vsep_app.views.tables import row_html, value_text

SHOWN_FRAMES = 200  # of the time figure
_START_COLOURS = {
    "cold": COLOURS["true"],
    "warm": COLOURS["interference"],
    "clean": COLOURS["cleaned"],
    "repeated": COLOURS["received"],
}
_HEADS = ("track", "object", "distance [m]", "velocity [m/s]", "SNR [dB]")
_PLACE = ("range", "velocity")


class StreetMaps:
    """Range-Doppler maps as received and without bursts, on common axes."""

    def __init__(self) -> None:
        self._axes = Axis(), Axis()
        for axis, limits in zip(self._axes, (RANGES_M, VELOCITIES_MPS), strict=True):
            axis.set(limits)
        low, high = MAP_LIMITS_DB
        scale = LinearColorMapper(palette=MAP_PALETTE, low=low, high=high)
        line = crosshair()
        self._images = {name: empty_image() for name in ("before", "after")}
        #: Has new data with every picture.
        self.source = self._images["after"]
        self._tracks = ColumnDataSource({"range": [], "velocity": [], "text": [], "alpha": []})
        self._truth = ColumnDataSource({"range": [], "velocity": []})
        self._scale = scale
        self.before = self._figure("before", "Range-Doppler, received", "radial velocity [m/s]")
        self.after = self._figure("after", "Range-Doppler, bursts cancelled", "")
        for plot in (self.before, self.after):
            plot.add_tools(CrosshairTool(overlay=line))
        add_colour_bar(self.after, scale)
        self._mark(self.after)
        self._mark_truth(self.before)

    def _figure(self, name: str, title: str, y_label: str) -> figure:
        return map_figure(
            self._images[name],
            title=title,
            y_label=y_label,
            axes=self._axes,
            name=f"street-{name}",
            scale=self._scale,
        )

    def _mark_truth(self, plot: figure) -> None:
        for colour, width in (("black", 3.5), (COLOURS["true"], 1.8)):
            look = {"marker": "cross", "size": 10, "line_color": colour, "line_width": width}
            plot.scatter(*_PLACE, source=self._truth, **look)

    def _mark(self, plot: figure) -> None:
        self._mark_truth(plot)
        for colour, width in (("black", 3.5), ("white", 1.6)):
            look = {"marker": "circle", "size": 14, "line_color": colour, "line_width": width}
            plot.scatter(*_PLACE, source=self._tracks, fill_color=None, line_alpha="alpha", **look)
        plot.text(
            *_PLACE,
            text="text",
            source=self._tracks,
            x_offset=10,
            y_offset=-6,
            text_color="white",
            text_alpha="alpha",
            text_font_size=LABEL_SIZE,
            background_fill_color="black",
            background_fill_alpha=0.5,
            padding=1,
        )

    def show(self, picture: StreetPicture) -> None:
        """Draw a picture."""
        box = image_box(picture.ranges_m, picture.velocities_mps)
        self._images["before"].data = {"image": [picture.map_before], **box}
        self._images["after"].data = {"image": [picture.map_after], **box}
        rows = picture.tracks
        put(
            self._tracks,
            {
                "range": short([row.range_m for row in rows]),
                "velocity": short([row.velocity_mps for row in rows]),
                "text": [track_label(row) for row in rows],
                "alpha": [1.0 if row.is_seen else 0.45 for row in rows],
            },
        )
        truth = {"range": picture.true_ranges_m, "velocity": picture.true_velocities_mps}
        put(self._truth, {name: short(column) for name, column in truth.items()})


class FrameTimes:
    """Time that each of the last frames took, against the time until the next one comes."""

    def __init__(self) -> None:
        self._frame, self._time = Axis(), Axis()
        self._frame.set((0.0, float(SHOWN_FRAMES)))
        self._time.set((0.0, 1.3e3 * CYCLE_S))
        labels = ("frame", "time [ms]")
        title = "Separation time (dashed: the next frame)"
        self.figure = plain_figure("street-times", title, labels, (self._frame, self._time))
        self.source = ColumnDataSource(self._empty())
        self.figure.vbar(
            "frame", top="ms", width=0.8, fill_color="colour", line_color=None, source=self.source
        )
        self.figure.add_layout(
            Span(
                location=1e3 * CYCLE_S,
                dimension="width",
                line_color=COLOURS["received"],
                line_dash=[5, 3],
            )
        )

    @staticmethod
    def _empty() -> dict[str, Any]:
        return {"frame": [], "ms": [], "colour": []}

    def clear(self) -> None:
        """Forget all frames: another sequence begins."""
        self.source.data = self._empty()

    def show(self, picture: StreetPicture) -> None:
        """Add the frame of a picture."""
        first = max(0, picture.number - SHOWN_FRAMES + 1)
        self._frame.set((float(first) - 1.0, float(first + SHOWN_FRAMES)))
        bar = {
            "frame": [picture.number],
            "ms": [1e3 * picture.seconds],
            "colour": [_START_COLOURS[picture.start]],
        }
        self.source.stream(bar, rollover=SHOWN_FRAMES)


def track_label(row: TrackRow) -> str:
    """Return identity and name of a track; clutter and rear ends have a number only.

    Examples
    --------
    >>> row = TrackRow(number=4, name="car 1", range_m=9.0, range_std_m=0.01, velocity_mps=-8.0,
    ...                velocity_std_mps=0.1, snr_db=40.0, is_seen=True)
    >>> track_label(row)
    '4 car 1'
    """
    name = "" if row.name.startswith("clutter") or row.name.endswith("rear") else row.name
    return f"{row.number} {name}".rstrip()


def tracks_html(rows: tuple[TrackRow, ...]) -> str:
    """Return the table of tracks."""
    head = "".join(f'<th scope="col">{name}</th>' for name in _HEADS)
    body = "".join(
        row_html(
            [
                str(row.number),
                escape(row.name) or "unknown",
                _with_std(row.range_m, row.range_std_m, 2, 3),
                _with_std(row.velocity_mps, row.velocity_std_mps, 2, 2),
                value_text(row.snr_db, 0),
            ],
            "" if row.is_seen else ' class="missed"',
        )
        for row in rows
    )
    if not rows:
        body = f'<tr><td class="empty" colspan="{len(_HEADS)}">No track yet.</td></tr>'
    return (
        '<table class="components methods" tabindex="0" aria-label="Tracks">'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _with_std(value: float, std: float, digits: int, std_digits: int) -> str:
    spread = value_text(std, std_digits)
    return f'{value_text(value, digits)}<span class="std"> ± {spread}</span>'


def sentence_of(picture: StreetPicture) -> str:
    """Return what happened in a frame, in plain words.

    Parameters
    ----------
    picture : StreetPicture
        Of the frame.
    """
    milliseconds = f"{1e3 * picture.seconds:.0f} ms"
    followed = f"{len(picture.tracks)} objects followed"
    if picture.num_bursts == 0:
        return f"Frame {picture.number}: no interference, {followed}, {milliseconds}."
    bursts = "burst" if picture.num_bursts == 1 else "bursts"
    return (
        f"Frame {picture.number}: {picture.num_bursts} {bursts} cancelled, {followed}, "
        f"{milliseconds}."
    )


def punctuality_text(punctuality: Punctuality) -> str:
    """Return how many frames were in time.

    Parameters
    ----------
    punctuality : Punctuality
        Counts of the sequence.

    Examples
    --------
    >>> punctuality_text(Punctuality(frames=400, in_time=398))
    '99.5 % of 400 frames in time'
    """
    if punctuality.frames == 0:
        return "no frame is counted yet"
    return f"{100.0 * punctuality.share:.1f} % of {punctuality.frames} frames in time"
