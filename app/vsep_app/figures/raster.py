"""Static raster of interference bursts: ramp, crossing time, residual of the timing fit."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from vsep.files.timing_lines import FrameTimings
from vsep.files.writing import written_beside

SIZE_INCHES = (9.0, 6.0)
DOTS_PER_INCH = 160
# Distinct to colour-blind readers (Okabe and Ito).
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")


def write_raster(frame: FrameTimings, out: Path) -> None:
    """Draw the bursts of a frame, the fitted crossing times that explain them, and residuals.

    The file is a .png or .svg; raises `OSError` if it cannot be written.
    """
    page = Figure(figsize=SIZE_INCHES, dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(page)
    raster, residuals = page.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    everything = frame.crossings
    raster.plot(everything.ramps, everything.samples, "x", color="0.55", label="bursts found")
    for number, timing in enumerate(frame.timings):
        colour = COLOURS[number % len(COLOURS)]
        predicted = timing.predicted()
        label = (
            f"{timing.slope_hz_per_s / 1e12:.4g} MHz/µs every {timing.ramp_period_s * 1e6:.6g} µs"
        )
        raster.plot(
            predicted.ramps,
            predicted.samples,
            "o",
            color=colour,
            markerfacecolor="none",
            label=label,
        )
        median = f"median {timing.median_residual:.2g}"
        residuals.plot(timing.crossings.ramps, timing.residuals, ".", color=colour, label=median)
    raster.set_ylabel("crossing [samples]")
    raster.set_title(f"{frame.file}: bursts and the timing of their radars", loc="left")
    residuals.set_ylabel("residual [samples]")
    residuals.set_xlabel("ramp")
    residuals.axhline(0.0, color="0.6", linewidth=0.8)
    for axes in (raster, residuals):
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8, frameon=False, loc="upper right")
    with written_beside(out) as beside:
        page.savefig(beside, format=out.suffix[1:].lower())
