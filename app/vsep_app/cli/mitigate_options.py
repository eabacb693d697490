"""The options of ``vsep mitigate``; what they do stands in `vsep_app.cli.mitigate_commands`."""

import argparse
from typing import Any

from vsep_app.cli.choices import MITIGATION_NAMES

_EXAMPLES = """\
examples:
  vsep mitigate frame.npz --method zeroing --out cleaned
  vsep mitigate night/*.npz --method mca-2d --mask autoregressive --out cleaned
  vsep mitigate drive-1.npz drive-2.npz drive-3.npz --method pm-ist --out cleaned
"""


def add_mitigate(commands: Any) -> None:
    """Add ``mitigate`` to the command line's commands."""
    parser = commands.add_parser(
        "mitigate",
        help="repair the interfered samples of frame files",
        description="Repair the interfered samples of frame files by one of the usual methods. For "
        "pm-ist and pm-iht the frames are a sequence: what was found in the last three lowers "
        "thresholds in the next.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_mitigate)
    parser.add_argument("frames", nargs="+", metavar="FRAME", help="a frame file, *.npz; in order")
    parser.add_argument(
        "--method",
        required=True,
        choices=MITIGATION_NAMES,
        metavar="NAME",
        help="%(choices)s",
    )
    add_mask_option(parser)
    add_antenna_option(parser)
    parser.add_argument(
        "--domain",
        choices=("masked-2d", "explicit-1d"),
        help="how compressive sensing computes: two-dimensional masked residual updates, or the "
        "explicit matrix for comparison (default: masked-2d)",
    )
    parser.add_argument(
        "--debias",
        action="store_true",
        default=None,
        help="end compressive sensing by a least-squares fit",
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder, made if need be, for DIR/<frame>.npz with cleaned and mask",
    )


def add_mask_option(parser: Any) -> None:
    """Add ``--mask``, which says how interfered samples are found."""
    parser.add_argument(
        "--mask",
        choices=("truth", "amplitude", "autoregressive", "residual"),
        help="interfered samples: from the frame file, or found by amplitude, prediction error or "
        "the residual of fitted objects (default: truth if the file has it, else autoregressive)",
    )


def add_antenna_option(parser: Any, default: str = "0") -> None:
    """Add ``--antenna``, for frame files that hold several."""
    parser.add_argument(
        "--antenna",
        type=int,
        metavar="N",
        help=f"which antenna of a frame file that holds several, from 0 (default: {default})",
    )


def _mitigate(options: argparse.Namespace) -> int:
    from vsep_app.cli.mitigate_commands import mitigate_frames

    return mitigate_frames(options)
