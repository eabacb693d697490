"""The options of ``vsep simulate``; what it does stands in `vsep_app.cli.simulate_commands`."""

import argparse
from collections.abc import Callable
from typing import Any

from vsep.presets.registry import PRESET_NAMES

# Seeds are kept as 64-bit integers in frame files.
_MAX_SEED = 2**63 - 1
_MAX_ANTENNAS = 1024
_EXAMPLES = """\
examples:
  vsep simulate --preset simulation-2-a --snr-db 60 --sir-db -20 --seed 7 --out frame.npz
  vsep simulate --preset simulation-2-b --antennas 4 --interferer-angle-deg -25 --out array.npz
"""


def add_simulate(commands: Any, whole_number: Callable[[int, int], Callable[[str], int]]) -> None:
    """Add ``simulate`` to the command line's commands.

    Parameters
    ----------
    commands : object
        Subparsers of the command line.
    whole_number : callable
        Makes the reader of a whole number from its bounds.
    """
    parser = commands.add_parser(
        "simulate",
        help="make a frame file from a preset",
        description="Make a frame file from a preset.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_simulate)
    parser.add_argument(
        "--preset", choices=PRESET_NAMES, required=True, help="scene and radar from the paper"
    )
    parser.add_argument(
        "--snr-db",
        type=float,
        metavar="X",
        help="object energy of the frame over the noise power of a sample (default: the preset's)",
    )
    parser.add_argument(
        "--sir-db",
        type=float,
        metavar="X",
        help="object energy over interference energy of the frame (default: the preset's)",
    )
    parser.add_argument(
        "--seed",
        type=whole_number(0, _MAX_SEED),
        default=0,
        metavar="N",
        help="the same seed gives the same file, byte for byte (default: 0)",
    )
    parser.add_argument(
        "--no-interference",
        action="store_true",
        help="leave the interferer out; objects and noise stay the same",
    )
    parser.add_argument("--out", required=True, metavar="FILE", help="the frame file, *.npz")
    _add_antennas(parser, whole_number)


def _add_antennas(
    parser: argparse.ArgumentParser, whole_number: Callable[[int, int], Callable[[str], int]]
) -> None:
    group = parser.add_argument_group(
        "several antennas", "A uniform line of them; SNR and SIR are those of one antenna."
    )
    group.add_argument(
        "--antennas",
        type=whole_number(1, _MAX_ANTENNAS),
        default=1,
        metavar="N",
        help="how many receive (default: 1)",
    )
    group.add_argument(
        "--antenna-spacing-wavelengths",
        type=float,
        metavar="X",
        help="from one to the next (default: 0.5)",
    )
    group.add_argument(
        "--object-angles-deg",
        type=float,
        nargs="+",
        metavar="X",
        help="direction of every object from broadside, positive towards the last antenna "
        "(default: drawn from the seed, up to 60 to both sides)",
    )
    group.add_argument(
        "--interferer-angle-deg",
        type=float,
        metavar="X",
        help="direction of the interferer (default: drawn likewise)",
    )


def _simulate(options: argparse.Namespace) -> int:
    from vsep_app.cli.simulate_commands import simulate_frame

    return simulate_frame(options)
