"""Options of ``vsep separability``."""

import argparse
from typing import Any

from vsep.presets.names import PRESET_NAMES

_EXAMPLES = """\
examples:
  vsep separability --x sir_db=-40:40:33 --y slope_difference=-2e12:-1e11:33 --out map.html
  vsep separability --scene simulation-2-c --x object_delay=-2e-7:2e-7:33 --y num_objects=1:20:20 \\
      --set sir_db=-10 --trials 5 --workers 2 --out map.png

parameters, in SI units; a name may lack its unit:
  sir_db, snr_db, slope_difference_hz_per_s, object_delay_s, num_objects, interfered_share,
  filter_cutoff_hz, filter_mismatch
"""


def add_separability(commands: Any) -> None:
    """Add ``separability`` to the command line's commands."""
    parser = commands.add_parser(
        "separability",
        help="map when objects and interference can be told apart",
        description="Map condition (27), the coherence of the bases and the bound's loss over two "
        "parameters, and with --trials what an estimator does.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_separability)
    for name in ("--x", "--y"):
        parser.add_argument(name, required=True, metavar="NAME=START:STOP:COUNT", help="an axis")
    parser.add_argument(
        "--scene",
        choices=PRESET_NAMES,
        default="simulation-1",
        help="radar, objects and paths (default: simulation-1)",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter that is on no axis; the scene's own by default",
    )
    parser.add_argument(
        "--trials",
        type=int,
        default=0,
        metavar="N",
        help="trials of the estimator in every cell (default: 0, which takes a second)",
    )
    parser.add_argument(
        "--estimator",
        default="factorised",
        metavar="NAME",
        help="who is tried, a method of `vsep study run` (default: factorised)",
    )
    parser.add_argument(
        "--schedule", choices=("robust", "paper"), default="robust", help="(default: robust)"
    )
    parser.add_argument(
        "--false-alarm-rate",
        type=float,
        metavar="X",
        help="objects expected in a frame of noise alone (default: 0.05)",
    )
    parser.add_argument(
        "--seed", type=int, default=1, metavar="N", help="draws objects, paths, noise (default: 1)"
    )
    parser.add_argument(
        "--workers", type=int, default=1, metavar="N", help="local processes (default: 1)"
    )
    parser.add_argument(
        "--out", required=True, metavar="FILE", help="the map, *.html, *.png, *.svg, *.pdf or *.csv"
    )


def _separability(options: argparse.Namespace) -> int:
    from vsep_app.cli.separability_commands import map_separability

    return map_separability(options)
