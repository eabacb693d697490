"""The options of ``vsep report``; what they do stands in `vsep_app.cli.report_commands`."""

import argparse
from collections.abc import Callable
from typing import Any

from vsep.presets.names import PRESET_NAMES
from vsep_app.cli.mitigate_options import add_antenna_option
from vsep_app.cli.report_commands import ESTIMATOR_OPTIONS, report

_EXAMPLES = """\
examples:
  vsep report frame.npz --out snapshot.html
  vsep report frame.npz --out snapshot.png --schedule paper --object-threshold-db 9
  vsep report --preset simulation-2-b --sir-db -30 --iterations 1,3,10 --out film.pdf
  vsep report --url 'http://127.0.0.1:5006/?preset=simulation-2-a&iteration=4' --out shared.html
  vsep report --rows fig-3.jsonl --trial 20/17/factorised --out outlier.html
  vsep report --preset simulation-2-c --record run.html --animate run.gif
  vsep report --from snapshot.html --out again.html
  vsep report night/*.npz --out reports

A report says how it was made, and --from makes it again, the same bytes with the same versions.
"""


def add_report(commands: Any, add_estimator_options: Callable[[Any], None]) -> None:
    """Add ``report`` to the command line's commands.

    Parameters
    ----------
    commands : object
        The command line's sub-parsers.
    add_estimator_options : callable
        Adds the options that ``separate`` and ``report`` have in common.
    """
    parser = commands.add_parser(
        "report",
        help="separate a frame and draw it",
        description="Separate a frame and draw it: as a page, a picture, a document, a recorded "
        "run or an animation, none of which asks for anything when opened.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=report)
    _add_sources(parser)
    _add_shown(parser)
    _add_outputs(parser)
    add_estimator_options(parser)
    # What is not given stays as the source has it.
    parser.set_defaults(**dict.fromkeys(ESTIMATOR_OPTIONS))


def _add_sources(parser: Any) -> None:
    parser.add_argument(
        "frames",
        nargs="*",
        metavar="FRAME",
        help="a frame file, *.npz; several make a folder of reports",
    )
    add_antenna_option(parser)
    group = parser.add_argument_group("instead of a frame file")
    group.add_argument(
        "--preset", choices=(*PRESET_NAMES, "real-frame"), help="a scene of the dashboard"
    )
    group.add_argument("--url", metavar="LINK", help="what a link to the live view shows")
    group.add_argument(
        "--trial",
        metavar="WHICH",
        help="a trial of a study: POINT/REALIZATION[/METHOD] with --rows, or the word in a link",
    )
    group.add_argument("--rows", metavar="FILE", help="with --trial: the rows of the study")
    group.add_argument(
        "--from",
        dest="made_before",
        metavar="REPORT",
        help="make a report again from what it says (with FRAME if it does not keep its frame)",
    )
    scene = parser.add_argument_group("the scene of --preset and --url")
    scene.add_argument("--snr-db", type=float, metavar="X", help="object energy over noise power")
    scene.add_argument("--sir-db", type=float, metavar="X", help="object over interference energy")
    scene.add_argument("--seed", type=int, metavar="N", help="(default: 7, as on the dashboard)")
    scene.add_argument("--no-interference", action="store_true", help="leave the interferer out")


def _add_shown(parser: Any) -> None:
    group = parser.add_argument_group("what is shown")
    group.add_argument(
        "--ramp", type=int, metavar="N", help="(default: the one with the strongest burst)"
    )
    group.add_argument("--iteration", type=int, metavar="N", help="(default: the last one)")
    group.add_argument(
        "--iterations", type=_numbers, metavar="N,N,...", help="a filmstrip of these, at most 6"
    )


def _add_outputs(parser: Any) -> None:
    group = parser.add_argument_group("what is written, one at least")
    group.add_argument(
        "--out",
        metavar="FILE",
        help="*.html (interactive), *.png, *.pdf (drawn for print) or *.json (numbers alone); for "
        "several frames a folder, made if need be",
    )
    group.add_argument(
        "--record", metavar="FILE", help="*.html: a slider goes through all iterations"
    )
    group.add_argument("--animate", metavar="FILE", help="*.gif, *.webp or, with ffmpeg, *.mp4")


def _numbers(text: str) -> tuple[int, ...]:
    numbers = tuple(int(part) for part in text.split(","))
    if min(numbers) < 0:
        raise argparse.ArgumentTypeError(f"{text} is given, iterations count from 0")
    return numbers


_numbers.__name__ = "list of iterations"
