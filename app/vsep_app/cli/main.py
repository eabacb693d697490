"""The ``vsep`` command: reads the command line, calls, and turns errors into one sentence.

It computes nothing. Exit codes: 0 done, 2 something handed over cannot be used, 130 interrupted,
141 the reader of the output went away.
"""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from vsep._version import __version__
from vsep.errors import InputError
from vsep_app.cli.calibrate_options import add_calibrate
from vsep_app.cli.choices import ESTIMATOR_NAMES
from vsep_app.cli.convert_options import add_convert
from vsep_app.cli.interferer_timing_options import add_timing
from vsep_app.cli.mitigate_options import add_antenna_option, add_mask_option, add_mitigate
from vsep_app.cli.report_options import add_report
from vsep_app.cli.separability_options import add_separability
from vsep_app.cli.simulate_options import add_simulate
from vsep_app.cli.study_options import add_study

_EXIT_INPUT = 2
_EXIT_INTERRUPTED = 130
_EXIT_BROKEN_PIPE = 141

_DESCRIPTION = "Separate the objects of an automotive FMCW radar from other radars' interference."
_COMMANDS = """\
`vsep COMMAND --help` explains a command. To watch the algorithm work: vsep serve --show
"""
_SERVE_EXAMPLES = """\
examples:
  vsep serve --show
  vsep serve --port 8080 --classroom           for everybody in the room, up to 40 pages
  vsep serve --experiments lecture-3           with guided experiments of your own
"""
_SEPARATE_EXAMPLES = """\
examples:
  vsep separate frame.npz --out results.jsonl
  vsep separate night/*.npz --out night.jsonl --signals separated --false-alarm-rate 0.01

A frame that cannot be read gets a line with "file" and "error"; the others are separated all the
same, and the exit code is 2 at the end.
"""


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, without the usage."""
        self.exit(_EXIT_INPUT, f"vsep: {message}; see {self.prog} --help.\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        What stands after ``vsep``; the process's own arguments by default.

    Returns
    -------
    int
        The exit code.
    """
    options = build_parser().parse_args(arguments)
    try:
        code: int = options.command(options)
        sys.stdout.flush()
    except InputError as error:
        return _fail(str(error))
    except BrokenPipeError:
        # Nobody reads any more; point the stream elsewhere, or its closing would notify_error.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _EXIT_BROKEN_PIPE
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        return _fail(f"{where}{error.strerror or error}.")
    except MemoryError:
        return _fail("the frame needs more memory than this machine has; give a smaller one.")
    except KeyboardInterrupt:
        sys.stderr.write("vsep: interrupted.\n")
        return _EXIT_INTERRUPTED
    return code


def _fail(sentence: str) -> int:
    sys.stderr.write(f"vsep: {sentence}\n")
    return _EXIT_INPUT


def build_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    parser = _Parser(
        prog="vsep",
        description=_DESCRIPTION,
        epilog=_COMMANDS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"vsep {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_serve(commands)
    add_simulate(commands, _whole_number)
    add_convert(commands)
    _add_separate(commands)
    add_report(commands, _add_estimator_options)
    add_timing(commands)
    add_mitigate(commands)
    add_calibrate(commands)
    add_study(commands)
    add_separability(commands)
    return parser


def _add_command(
    commands: "argparse._SubParsersAction[_Parser]",
    name: str,
    command: Callable[[argparse.Namespace], int],
    summary: str,
    examples: str,
) -> _Parser:
    parser = commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=examples,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=command)
    return parser


def _add_serve(commands: "argparse._SubParsersAction[_Parser]") -> None:
    parser = _add_command(commands, "serve", _serve, "serve the dashboard", _SERVE_EXAMPLES)
    parser.add_argument(
        "--port",
        type=_whole_number(0, 65535),
        default=5006,
        metavar="N",
        help="port to listen on, 0 for any free one (default: 5006)",
    )
    parser.add_argument(
        "--address",
        metavar="A",
        help="address to listen on (default: 127.0.0.1, this machine only; 0.0.0.0, its network, "
        "with --classroom)",
    )
    parser.add_argument(
        "--classroom",
        action="store_true",
        help="share the machine among many: at most 40 pages, one study, 32 iterations kept of a "
        "run; /health tells how it goes",
    )
    parser.add_argument("--show", action="store_true", help="open the dashboard in the browser")
    parser.add_argument(
        "--experiments",
        type=Path,
        metavar="FOLDER",
        help="folder of your own guided experiments, one text file each",
    )


def _add_separate(commands: "argparse._SubParsersAction[_Parser]") -> None:
    parser = _add_command(
        commands, "separate", _separate, "separate frame files", _SEPARATE_EXAMPLES
    )
    parser.add_argument("frames", nargs="+", metavar="FRAME", help="a frame file, *.npz")
    _add_out(parser, "the results, one JSON line per frame, in order")
    parser.add_argument(
        "--signals",
        metavar="DIR",
        help="folder, made if need be, for DIR/<frame>.npz with object_signal, "
        "interference_signal and cleaned",
    )
    add_antenna_option(
        parser, "all together, with angles of arrival; joint and masked take one, antenna 0"
    )
    parser.add_argument(
        "--response",
        metavar="FILE",
        help="the receiver's response as vsep calibrate writes it, *.npz, in place of the filter "
        "that a frame file names",
    )
    parser.add_argument(
        "--clutter",
        choices=("keep", "remove"),
        default="keep",
        help="objects that stand still: estimated like all others, or left out together with a "
        "receiver's settling transient, as the median over the ramps (default: keep)",
    )
    parser.add_argument(
        "--interferer-timing",
        action="store_true",
        help="fit the interfering radars to the bursts found, and look again, with a lower "
        "threshold, where they must have sent more (factorised and joint)",
    )
    parser.add_argument(
        "--workers",
        type=_whole_number(1, 4096),
        default=None,
        metavar="N",
        help="processes that share the frames (default: one for every core)",
    )
    parser.add_argument(
        "--profile",
        action="store_true",
        help='say where the time goes: "profile" in every line, and a table at the end',
    )
    _add_estimator_options(parser)


def _add_out(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument("--out", required=True, metavar="FILE", help=what)


def _add_estimator_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the estimator")
    group.add_argument(
        "--estimator",
        choices=ESTIMATOR_NAMES,
        default="factorised",
        metavar="NAME",
        help="one of %(choices)s: objects and interference with separate posteriors or a joint "
        "one, objects alone, or objects from the samples that the mask leaves "
        "(default: factorised)",
    )
    add_mask_option(group)
    group.add_argument(
        "--schedule",
        choices=("robust", "paper"),
        help="order of updates; the literal one of the paper for comparison "
        "(default: robust; factorised and joint)",
    )
    threshold = group.add_mutually_exclusive_group()
    threshold.add_argument(
        "--false-alarm-rate",
        type=float,
        default=0.05,
        metavar="X",
        help="objects expected in a frame of noise alone (default: 0.05)",
    )
    threshold.add_argument(
        "--object-threshold-db", type=float, metavar="X", help="the object threshold itself"
    )
    group.add_argument(
        "--interference-threshold-db",
        type=float,
        metavar="X",
        help="threshold of interference-channel components "
        "(default: that of the schedule; factorised and joint)",
    )
    group.add_argument(
        "--max-iterations",
        type=int,
        default=100,
        metavar="N",
        help="where a run stops at the latest (default: 100)",
    )


def _whole_number(lowest: int, highest: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        value = int(text)
        if not lowest <= value <= highest:
            raise argparse.ArgumentTypeError(
                f"{value} is given, it must lie between {lowest} and {highest}"
            )
        return value

    parse.__name__ = "whole number"
    return parse


def _serve(options: argparse.Namespace) -> int:
    from vsep_app.jobs.warmup import compile_everything
    from vsep_app.server.main import CLASSROOM, serve

    sys.stderr.write("vsep: getting ready; the very first time takes a minute or more.\n")
    compile_everything()
    own = "0.0.0.0" if options.classroom else "127.0.0.1"
    serve(
        port=options.port,
        address=options.address or own,
        show=options.show,
        experiments=options.experiments,
        rules=CLASSROOM if options.classroom else None,
    )
    return 0


def _separate(options: argparse.Namespace) -> int:
    from vsep_app.cli.separate import separate_frames

    return separate_frames(options)
