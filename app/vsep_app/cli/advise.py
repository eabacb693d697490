"""``vsep advise``: settings of this radar that let the fewest bursts of another one in."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from vsep.analysis.timing_advice import Exposure, OtherRadar, exposure, exposures
from vsep.errors import InputError
from vsep.files.timing_lines import read_timings
from vsep.files.writing import write_table
from vsep.recordings.configurations.registry import (
    merged,
    read_configuration_file,
    settings_of,
)
from vsep.recordings.settings import RecordingSettings
from vsep.signal.radar import ChirpSequence
from vsep_app.cli.shared_options import add_file, add_number, integer, require_dashboard

DESCRIPTION = (
    "Say which slope, start frequency and idle time of this radar let the fewest bursts of another "
    "radar in: the timing of the other one is that which vsep interferer-timing tells, or given."
)
EXAMPLES = """\
examples:
  vsep advise results.jsonl
  vsep advise results.jsonl --slopes 25:35:11 --idle-us=-3:20:24 --out map.png
  vsep advise --settings radar.cfg --other 10:72.3 --start-mhz 0:400:5
  vsep advise --settings radar.cfg --other 10:72.3:77:60 --out table.csv

Ranges are FIRST:LAST:COUNT. --idle-us and --start-mhz are added to what the radar has now. Shares
are means over the unknown time offset of both radars; the worst one is told, too.
"""
_PICTURES: Final = (".png", ".svg")
_COLUMNS: Final = (
    "slope_mhz_per_us",
    "start_ghz",
    "ramp_period_us",
    "ramps_hit",
    "worst_ramps_hit",
    "samples_hit",
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "results",
        nargs="?",
        metavar="RESULTS",
        help="what vsep separate wrote, *.jsonl: this radar, and the others by their bursts",
    )
    add_file(
        parser,
        "--settings",
        "this radar, as for vsep convert, instead of RESULTS; with --other",
        action="append",
    )
    parser.add_argument(
        "--other",
        type=_other,
        action="append",
        metavar="SLOPE:PERIOD[:START[:DURATION]]",
        help="another radar: MHz/us, us, GHz, us; may be repeated",
    )
    parser.add_argument(
        "--slopes", type=_range, metavar="RANGE", help="MHz/us (default: 20 %% around the present)"
    )
    parser.add_argument(
        "--idle-us",
        type=_range,
        metavar="RANGE",
        help="added to the idle time, us (default: from none to half a period)",
    )
    parser.add_argument(
        "--start-mhz",
        type=_range,
        metavar="RANGE",
        default=(0.0,),
        help="added to the start frequency, MHz; matters where the other's is known (default: 0)",
    )
    add_number(parser, "--best", "rows of the table (default: 10)", integer(1, 1000), default=10)
    add_file(
        parser,
        "--out",
        "a map over slope and period, *.png or *.svg, or the whole table, *.csv",
    )


def run(options: argparse.Namespace) -> int:
    """Print the best settings beside the present ones, and write a map or a table."""
    suffix = Path(options.out or "").suffix.lower()
    if options.out is not None and suffix not in (*_PICTURES, ".csv"):
        raise InputError(f"--out {options.out} must end in .png, .svg or .csv.")
    drawing: Any = None
    if suffix in _PICTURES:
        drawing = require_dashboard("vsep_app.figures.advice", f"advise --out {options.out}")
    radar, others = _radars(options)
    found = list(_tried(radar, others, options))
    if not found:
        raise InputError("No setting is left: all ramps would last longer than their period.")
    found.sort(key=lambda each: (each.ramp_share, each.worst_ramp_share, each.sample_share))
    present = exposure(radar, others)
    for line in _lines(present, found[: options.best], others):
        sys.stdout.write(f"{line}\n")
    if drawing is not None:
        drawing.write_advice_map(found, present, Path(options.out))
    elif suffix:
        write_table(options.out, _COLUMNS, map(_row, found))
    return 0


def _radars(options: argparse.Namespace) -> tuple[ChirpSequence, list[OtherRadar]]:
    """Return this radar and the others."""
    others = list(options.other or ())
    if (options.results is None) == (options.settings is None):
        raise InputError("This radar is needed once: RESULTS, or --settings with --other.")
    if options.settings is not None:
        said = merged({path: read_configuration_file(path) for path in options.settings})
        radar = _radar_of(settings_of(said, "adc.bin", ", ".join(options.settings)))
    else:
        frames = list(read_timings(options.results))
        told = [timing for frame in frames for timing in frame.timings]
        if not frames or not (told or others):
            raise InputError(
                f"{options.results} holds not enough evidence of another radar's timing; say it by "
                "--other."
            )
        radar = frames[0].radar
        if not others:
            # A radar may be told by each frame, and on both sides of a gap.
            for timing in sorted(told, key=lambda each: -len(each.chirps)):
                if all(abs(timing.ramp_period_s / o.ramp_period_s - 1.0) > 0.01 for o in others):
                    others.append(OtherRadar.of_timing(timing))
    if not others:
        raise InputError("No other radar is given; say its timing by --other.")
    return radar, others


def _radar_of(settings: RecordingSettings) -> ChirpSequence:
    if settings.num_samples is None or settings.num_ramps is None:
        raise InputError("num_samples and num_ramps are needed to count bursts; give both.")
    start_hz = settings.start_frequency_hz + settings.slope_hz_per_s * settings.adc_start_s
    return ChirpSequence(
        start_frequency_hz=start_hz,
        slope_hz_per_s=settings.slope_hz_per_s,
        sample_rate_hz=settings.sample_rate_hz,
        ramp_period_s=settings.ramp_period_s,
        num_samples=settings.num_samples,
        num_ramps=settings.num_ramps,
    )


def _tried(radar: ChirpSequence, others: Sequence[OtherRadar], options: argparse.Namespace) -> Any:
    slopes = [1e12 * slope for slope in options.slopes or ()]
    slopes = slopes or list(radar.slope_hz_per_s * np.linspace(0.8, 1.2, 17))
    added = [1e-6 * each for each in options.idle_us or ()]
    added = added or list(radar.ramp_period_s * np.linspace(0.0, 0.5, 26))
    return exposures(
        radar,
        others,
        slopes_hz_per_s=slopes,
        ramp_periods_s=[radar.ramp_period_s + each for each in added],
        start_frequencies_hz=[radar.start_frequency_hz + 1e6 * each for each in options.start_mhz],
    )


def _lines(present: Exposure, best: Sequence[Exposure], others: Sequence[OtherRadar]) -> list[str]:
    lines = [
        f"other radar: {each.slope_hz_per_s / 1e12:.5g} MHz/us every "
        f"{each.ramp_period_s * 1e6:.6g} us"
        for each in others
    ]
    lines.append(f"{'':8}{'MHz/us':>9}{'GHz':>9}{'us':>9}{'ramps':>8}{'worst':>8}{'samples':>9}")
    for name, each in (("present", present), *(("", each) for each in best)):
        slope, start, period, ramps, worst, samples = _row(each)
        lines.append(
            f"{name:8}{slope:9.3f}{start:9.4f}{period:9.3f}{ramps:8.1%}{worst:8.1%}{samples:9.2%}"
        )
    return lines


def _row(each: Exposure) -> tuple[float, ...]:
    return (
        each.radar.slope_hz_per_s / 1e12,
        each.radar.start_frequency_hz / 1e9,
        each.radar.ramp_period_s * 1e6,
        each.ramp_share,
        each.worst_ramp_share,
        each.sample_share,
    )


def _range(text: str) -> tuple[float, ...]:
    parts = text.split(":")
    if len(parts) == 1:
        return (float(text),)
    if len(parts) != 3 or not 1 <= int(parts[2]) <= 1000:
        raise argparse.ArgumentTypeError(f"{text} is given; FIRST:LAST:COUNT is needed")
    first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
    return tuple(float(value) for value in np.linspace(first, last, count))


def _other(text: str) -> OtherRadar:
    slope, period, *more = (float(part) for part in text.split(":"))
    if len(more) > 2:
        raise argparse.ArgumentTypeError(f"{text} is given; at most four numbers are needed")
    return OtherRadar(
        slope_hz_per_s=1e12 * slope,
        ramp_period_s=1e-6 * period,
        start_frequency_hz=1e9 * more[0] if more else None,
        ramp_duration_s=1e-6 * more[1] if len(more) > 1 else None,
    )


_range.__name__, _other.__name__ = "range", "radar"
