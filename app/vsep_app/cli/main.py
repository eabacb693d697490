"""The ``vsep`` command: reads the command line, calls, and turns errors into one sentence.

A command's module is loaded once the command is chosen, so that ``vsep --help`` is quick. It has
``DESCRIPTION`` and ``EXAMPLES`` for its help, ``add_options(parser)`` and ``run(options)``, which
returns the exit code: 0 done, 2 something handed over cannot be used, 3 something is missing that
giving the same command again may add. Beside these there are 130 for interrupted, 143 for
terminated and 141 where the reader of the output went away.
"""

import argparse
import io
import os
import shlex
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Final, NoReturn

from vsep._processes import SINGLE_THREAD
from vsep._version import __version__
from vsep.errors import InputError
from vsep.kernels.clock import listeners

_EXIT_INPUT = 2
_EXIT_INTERRUPTED = 130
_EXIT_BROKEN_PIPE = 141
_EXIT_TERMINATED = 143

COMMANDS: Final[dict[str, tuple[str, str]]] = {
    "serve": ("vsep_app.cli.serve", "serve the dashboard"),
    "simulate": ("vsep_app.cli.simulate", "make a frame file from a preset"),
    "convert": ("vsep_app.cli.convert", "make a frame file of a sensor's recording"),
    "watch": ("vsep_app.cli.watch", "separate the captures of a folder as they come"),
    "separate": ("vsep_app.cli.separate", "separate frame files"),
    "stream": ("vsep_app.cli.stream", "separate sequences of frames and follow their objects"),
    "report": ("vsep_app.cli.report", "separate a frame and draw it"),
    "interferer-timing": (
        "vsep_app.cli.interferer_timing",
        "estimate the interfering radars' chirps from separated frames",
    ),
    "advise": ("vsep_app.cli.advise", "settings that let the fewest bursts of another radar in"),
    "mitigate": ("vsep_app.cli.mitigate", "repair the interfered samples of frame files"),
    "calibrate": (
        "vsep_app.cli.calibrate",
        "estimate the receiver's complex response from the bursts in frame files",
    ),
    "add-bursts": (
        "vsep_app.cli.add_bursts",
        "put the bursts of one measurement into the frame of another",
    ),
    "study": ("vsep_app.cli.study", "Monte-Carlo studies: the paper's figures with intervals"),
    "reproduce": (
        "vsep_app.cli.reproduce",
        "make the figures and check the numbers of both papers",
    ),
    "bench": ("vsep_app.cli.bench", "measure methods on frozen scenes, your own too"),
    "separability": (
        "vsep_app.cli.separability",
        "map when objects and interference can be told apart",
    ),
}
"""Module and summary of every command."""

_DESCRIPTION = "Separate the objects of an automotive FMCW radar from other radars' interference."
_EPILOG = "`vsep COMMAND --help` explains a command. To watch the algorithm work: vsep serve --show"


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one sentence."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong, without the usage."""
        self.exit(_EXIT_INPUT, f"vsep: {message}; see {self.prog} --help.\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    The matrices are small: a second thread of linear algebra gains nothing, and beside other busy
    programs the threads wait for each other (12 frames of Simulation II: 25 s with two threads, 2 s
    with one). The libraries read the environment when they are loaded, so it is set before a
    command's module is; a number of threads that is set already stays.

    Parameters
    ----------
    arguments : sequence of str, optional
        What stands after ``vsep``; the process's own arguments by default.

    Returns
    -------
    int
        The exit code.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Of a file name that is no UTF-8 the bytes are shown, as on standard error.
        sys.stdout.reconfigure(errors="backslashreplace")
    for name in SINGLE_THREAD:
        os.environ.setdefault(name, "1")
    if sys.stderr.isatty():
        listeners.add(_show_compilation)
    try:
        with _terminable():
            options = parse(sys.argv[1:] if arguments is None else arguments)
            code: int = options.run(options)
            sys.stdout.flush()
    except InputError as error:
        return _fail(str(error))
    except BrokenPipeError:
        # Nobody reads any more; point the stream elsewhere, or its closing would raise again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _EXIT_BROKEN_PIPE
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        return _fail(f"{where}{error.strerror or error}.")
    except MemoryError:
        return _fail("the frame needs more memory than this machine has; give a smaller one.")
    except KeyboardInterrupt as signalled:
        terminated = isinstance(signalled, _Terminated)
        sys.stderr.write(f"vsep: {'terminated' if terminated else 'interrupted'}.\n")
        return _EXIT_TERMINATED if terminated else _EXIT_INTERRUPTED
    return code


def _show_compilation(kernel: str) -> None:
    """Show on the terminal that a kernel is being compiled; wipe that out when it is."""
    shown = f"vsep: compiling {kernel}, once after an installation" if kernel else ""
    sys.stderr.write(f"\r\x1b[K{shown}")
    sys.stderr.flush()


class _Terminated(KeyboardInterrupt):
    """The system asks the command to end, which ends it as Ctrl-C does."""


@contextmanager
def _terminable() -> Iterator[None]:
    """Clean up when the process is terminated, as systemd, docker and kill do."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only that thread gets signals
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: object) -> NoReturn:
    del number, frame
    # Cleaning up is not to be cut short by another signal.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise _Terminated


def _fail(sentence: str) -> int:
    sys.stderr.write(f"vsep: {sentence}\n")
    return _EXIT_INPUT


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Read the command line; of all the commands only the one it names is loaded.

    Returns
    -------
    argparse.Namespace
        The options; ``run`` is the function that carries them out, ``typed`` the command line.
    """
    parser = _Parser(
        prog="vsep",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"vsep {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (module_name, summary) in COMMANDS.items():
        if name != next(iter(arguments), None):
            commands.add_parser(name, help=summary)
            continue
        module = import_module(module_name)
        command = commands.add_parser(
            name,
            help=summary,
            description=module.DESCRIPTION,
            epilog=module.EXAMPLES,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        command.set_defaults(run=module.run, typed=shlex.join(["vsep", *arguments]))
        module.add_options(command)
    return parser.parse_args(arguments)
