"""The options of ``vsep calibrate``; what they do stands in `vsep_app.cli.calibrate_commands`."""

import argparse
from typing import Any

_EXAMPLES = """\
examples:
  vsep calibrate drive.npz --out response.npz
  vsep calibrate drive-1.npz drive-2.npz --slope-difference 19.312e12 --out response.npz
  vsep separate night.npz --response response.npz --out night.jsonl
"""


def add_calibrate(commands: Any) -> None:
    """Add ``calibrate`` to the command line's commands."""
    parser = commands.add_parser(
        "calibrate",
        help="estimate the receiver's complex response from the bursts in frame files",
        description="Estimate the receiver's complex response from the bursts in frame files of "
        "one receiver, and say how well it reproduces them.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_calibrate)
    parser.add_argument("frames", nargs="+", metavar="RECORDING", help="a frame file, *.npz")
    parser.add_argument(
        "--slope-difference",
        type=float,
        metavar="X",
        help="slope at which the bursts sweep in the frame files, Hz/s, where it is known "
        "(default: estimated from the bursts)",
    )
    parser.add_argument(
        "--out", required=True, metavar="FILE", help="the response file, *.npz, for separate"
    )


def _calibrate(options: argparse.Namespace) -> int:
    from vsep_app.cli.calibrate_commands import calibrate_frames

    return calibrate_frames(options)
