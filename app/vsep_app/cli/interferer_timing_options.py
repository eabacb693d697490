"""Options of ``vsep interferer-timing``."""

import argparse
from typing import Any

_EXAMPLES = """\
examples:
  vsep interferer-timing results.jsonl
  vsep interferer-timing results.jsonl --out raster.png
  vsep interferer-timing results.jsonl --out bursts.csv
"""


def add_timing(commands: Any) -> None:
    """Add ``lattice`` to the command line's commands."""
    parser = commands.add_parser(
        "interferer-timing",
        help="what the interfering radars are, from the bursts of separated frames",
        description="Tell slope, chirp interval and offset of the interfering radars from when the "
        "bursts that vsep separate found cross the band: one JSON line per frame.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_timing)
    parser.add_argument("results", metavar="RESULTS", help="what vsep separate wrote, *.jsonl")
    parser.add_argument(
        "--out",
        metavar="FILE",
        help="the raster of the first frame with its residuals, *.png or *.svg, or all bursts, "
        "*.csv",
    )


def _timing(options: argparse.Namespace) -> int:
    from vsep_app.cli.interferer_timing_commands import describe_timings

    return describe_timings(options)
