"""Map of the ramps that another radar hits, over this radar's slope and ramp period."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vsep.analysis.timing_advice import Exposure
from vsep.files.writing import written_beside

SIZE_INCHES = (7.0, 4.6)
DOTS_PER_INCH = 160


def write_advice_map(tried: Sequence[Exposure], present: Exposure, out: Path) -> None:
    """Draw the share of ramps hit at the best start frequency; the present setting is a cross.

    The file is a .png or .svg; raises `OSError` if it cannot be written.
    """
    slopes = sorted({each.radar.slope_hz_per_s for each in tried})
    periods = sorted({each.radar.ramp_period_s for each in tried})
    shares = np.full((len(periods), len(slopes)), np.nan)
    for each in tried:
        cell = periods.index(each.radar.ramp_period_s), slopes.index(each.radar.slope_hz_per_s)
        shares[cell] = np.fmin(shares[cell], each.ramp_share)
    page = Figure(figsize=SIZE_INCHES, dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(page)
    axes = page.subplots()
    x, y = np.array(slopes) / 1e12, np.array(periods) * 1e6
    image = axes.pcolormesh(x, y, 100.0 * shares, shading="nearest", cmap="viridis")
    page.colorbar(image, label="ramps hit [%]")
    best = tried[0].radar
    for radar, mark, label in ((present.radar, "x", "present"), (best, "o", "best")):
        place = radar.slope_hz_per_s / 1e12, radar.ramp_period_s * 1e6
        axes.plot(*place, mark, color="white", markerfacecolor="none", markeredgewidth=2)
        axes.annotate(label, place, color="white", xytext=(6, 4), textcoords="offset points")
    axes.set_xlabel("slope [MHz/µs]")
    axes.set_ylabel("ramp period [µs]")
    with written_beside(out) as beside:
        page.savefig(beside, format=out.suffix[1:].lower())
