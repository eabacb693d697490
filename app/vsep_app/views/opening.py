"""First picture of a run as plain HTML: something to see while the page itself is still loading."""

import base64
import struct
import zlib
from html import escape
from typing import Any

import numpy as np
from bokeh.palettes import Viridis256

from vsep_app.model.picture import Picture
from vsep_app.model.static_picture import StaticPicture
from vsep_app.views.style import COLOURS

_WIDTH, _HEIGHT = 1000, 200
_SMALL = 128


def opening_html(picture: Picture) -> str:
    """Return headline, chirps, both signals of the ramp and the map of a picture."""
    static_picture, crossing = picture.static_picture, picture.crossing
    plane = crossing.plane
    across, upwards = plane.limits
    ramps = np.arange(plane.num_ramps)
    zero, end = np.zeros(len(ramps)), np.full(len(ramps), plane.ramp_us)
    own = *plane.place(ramps, zero, zero), *plane.place(ramps, end, zero)
    first, last = crossing.true.within(plane.reach_mhz, plane.ramp_us)
    true = crossing.true
    other = (
        *plane.place(true.ramps, first, true.at(first)),
        *plane.place(true.ramps, last, true.at(last)),
    )
    chirps = _segments(own, (across, upwards), "object") + _segments(
        other, (across, upwards), "interference"
    )
    fast = picture.fast_time
    delay = picture.delay
    ends = static_picture.shown_ranges_m
    parts = [
        _svg("Chirps over all ramps", chirps),
        _svg(
            f"Fast time, ramp {picture.ramp}",
            _line(fast.axis, fast.received, (fast.axis[0], fast.axis[-1]), fast_limits(picture)),
        ),
        _svg(
            f"Delay spectrum, ramp {picture.ramp}",
            _line(delay.axis, delay.received, ends, static_picture.spectrum_limits_db),
        ),
    ]
    if plane.num_ramps > 1:
        parts.append(_map_html(picture))
    return f'<p class="headline">{escape(picture.headline)}</p>' + "".join(parts)


def fast_limits(picture: Picture) -> tuple[float, float]:
    """Return the ends of the axis of the signal over fast time."""
    static_picture = picture.static_picture
    real = picture.fast_time_mode == "real"
    return static_picture.real_limits if real else static_picture.level_limits_db


def _svg(title: str, content: str) -> str:
    return (
        f"<figure><figcaption>{escape(title)}</figcaption>"
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" preserveAspectRatio="none" aria-hidden="true">'
        f"{content}</svg></figure>"
    )


def _places(values: Any, limits: tuple[float, float], size: int) -> Any:
    return np.clip((np.asarray(values) - limits[0]) / (limits[1] - limits[0]), 0.0, 1.0) * size


def _line(x: Any, y: Any, across: tuple[float, float], upwards: tuple[float, float]) -> str:
    inside = (np.asarray(x) >= across[0]) & (np.asarray(x) <= across[1])
    left = _places(np.asarray(x)[inside], across, _WIDTH)
    top = _HEIGHT - _places(np.asarray(y)[inside], upwards, _HEIGHT)
    points = " ".join(f"{a:.0f},{b:.0f}" for a, b in zip(left, top, strict=True))
    return f'<polyline points="{points}" stroke="{COLOURS["received"]}"/>'


def _segments(ends: Any, limits: Any, role: str) -> str:
    x0, y0, x1, y1 = ends
    across, upwards = limits
    columns = (
        _places(x0, across, _WIDTH),
        _HEIGHT - _places(y0, upwards, _HEIGHT),
        _places(x1, across, _WIDTH),
        _HEIGHT - _places(y1, upwards, _HEIGHT),
    )
    path = "".join(f"M{a:.0f} {b:.0f}L{c:.0f} {d:.0f}" for a, b, c, d in zip(*columns, strict=True))
    return f'<path d="{path}" stroke="{COLOURS[role]}"/>'


def _map_html(picture: Picture) -> str:
    """Return the map of the frame as received: the part of it that the views show."""
    image = base64.b64encode(png(shown_map(picture.static_picture))).decode()
    return (
        "<figure><figcaption>Range-Doppler, received</figcaption>"
        f'<img alt="" src="data:image/png;base64,{image}"></figure>'
    )


def shown_map(
    static_picture: StaticPicture, ranges_m: Any = None, velocities_mps: Any = None
) -> "np.ndarray[Any, np.dtype[np.uint8]]":
    """Return the map as received within limits, by default those of the views, upper row first."""
    ranges = ranges_m or static_picture.shown_ranges_m
    velocities = velocities_mps or static_picture.shown_velocities_mps or (-np.inf, np.inf)
    chosen = [
        (axis >= limits[0]) & (axis <= limits[1])
        for axis, limits in (
            (static_picture.map_velocities_mps, velocities),
            (static_picture.map_ranges_m, ranges),
        )
    ]
    return static_picture.map_before[np.ix_(*chosen)][::-1]


def small_map(pixels: "np.ndarray[Any, np.dtype[np.uint8]]") -> bytes:
    """Return a map, from its lowest row, as a small PNG file: of every cell the strongest kept."""
    step = max(1, pixels.shape[1] // _SMALL)
    columns = pixels.shape[1] // step * step
    strongest = pixels[::-1, :columns].reshape(len(pixels), -1, step).max(axis=2)
    return png(strongest)


def png(pixels: "np.ndarray[Any, np.dtype[np.uint8]]", colours: int = 256) -> bytes:
    r"""Return an image in the colours of the maps as a PNG file; the first row is the upper one.

    With fewer colours, a divisor of 256, the file is smaller.

    Examples
    --------
    >>> png(np.zeros((2, 3), dtype=np.uint8))[:4]
    b'\x89PNG'
    """
    height, width = pixels.shape
    step = 256 // colours
    palette = b"".join(bytes.fromhex(colour[1:]) for colour in Viridis256[step // 2 :: step])
    rows = b"".join(b"\0" + row.tobytes() for row in pixels // step)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", palette),
        (b"IDAT", zlib.compress(rows)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
