"""Options and checks that several commands have in common."""

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import MISSING, fields
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from vsep.errors import InputError

EXIT_INPUT: Final = 2
"""Exit code where something that was handed over cannot be used."""
EXIT_INCOMPLETE: Final = 3
"""Exit code where something is missing that giving the same command again may add."""
_PROJECT = ("vsep", "vsep_app")


def defaults_of(kind: Any) -> dict[str, Any]:
    """Return the defaults of a dataclass by field."""
    return {each.name: each.default for each in fields(kind) if each.default is not MISSING}


def given(options: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Return the options that were given, by name."""
    values = {name: getattr(options, name) for name in names}
    return {name: value for name, value in values.items() if not (value is None or value is False)}


def refuse_unused(
    values: Mapping[str, Any], chosen: Sequence[str], settings: Mapping[str, Set[str]]
) -> None:
    """Refuse a setting that nothing chosen takes.

    Parameters
    ----------
    values : mapping
        Options that were given, see `given`.
    chosen : sequence of str
        What they are for, for example an estimator.
    settings : mapping
        Names of the settings of everything that could have been chosen.

    Raises
    ------
    InputError
        Names option, value and who takes it.
    """
    taken = frozenset[str]().union(*(settings[name] for name in chosen))
    for name, value in values.items():
        if name not in taken:
            what = option_of(name) + (" is given" if value is True else f" is {value}")
            takers = [other for other, names in settings.items() if name in names]
            takes, do = ("takes", "take")[len(chosen) > 1], ("does", "do")[len(takers) > 1]
            raise InputError(f"{what}; {listed(chosen)} {takes} none ({listed(takers)} {do}).")


def refuse_without_interference(values: Mapping[str, Any]) -> None:
    """Refuse settings of an interferer that a scene leaves out."""
    scenes = {"a scene with an interferer": values.keys(), "a scene without one": frozenset[str]()}
    refuse_unused(values, ("a scene without one",), scenes)


def option_of(name: str) -> str:
    """Return a setting as the command line spells it."""
    return "--" + name.replace("_", "-")


def listed(names: Sequence[str]) -> str:
    """Return names as an enumeration: a, b and c."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def require_dashboard(module: str, command: str) -> Any:
    """Return a module that draws; `InputError` where the libraries of a command are missing."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".", maxsplit=1)[0] in _PROJECT:
            raise
        sentence = f"`vsep {command}` needs the dashboard: pip install 'vsep[dashboard]'."
        raise InputError(sentence) from None


def require_folder(out: str | Path) -> None:
    """Refuse a file in a folder that does not exist."""
    folder = Path(out).parent
    if not folder.is_dir():
        raise InputError(f"{out} cannot be written: {folder} is no folder; make it first.")


def require_other_file(out: str, inputs: Iterable[str], what: str) -> None:
    """Refuse an output that would overwrite an input; `what` says what the inputs are."""
    if Path(out).resolve() in {Path(name).resolve() for name in inputs}:
        raise InputError(f"--out {out} {what}; it must be another file.")


def require_distinct_names(frames: Sequence[str]) -> None:
    """Refuse frame files of one name, which a folder of outputs cannot tell apart."""
    name, count = Counter(Path(frame).stem for frame in frames).most_common(1)[0]
    if count > 1:
        raise InputError(f"{count} frames are named {name}; names must be distinct.")


def error_text(path: str, error: InputError | MemoryError) -> str:
    """Return what is wrong with a frame; a MemoryError carries no text."""
    return str(error) or f"{path} needs more memory than this machine has."


def lost_lines(paths: Sequence[str], sentence: str) -> list[dict[str, Any]]:
    """Return the result lines of frames that a worker could not separate."""
    return [{"file": path, "error": f"{path}: {sentence}"} for path in paths]


def integer(lowest: int, highest: int) -> Callable[[str], int]:
    """Return the reader of an integer within bounds."""

    def parse(text: str) -> int:
        value = int(text)
        if not lowest <= value <= highest:
            raise argparse.ArgumentTypeError(
                f"{value} is given, it must lie between {lowest} and {highest}"
            )
        return value

    parse.__name__ = "integer"
    return parse


def add_number(parser: Any, option: str, what: str, kind: Any = float, **more: Any) -> None:
    """Add an option that is a number, or several."""
    metavar = "X" if kind is float else "N"
    parser.add_argument(option, type=kind, metavar=metavar, help=what, **more)


def add_file(parser: Any, option: str, what: str, metavar: str = "FILE", **more: Any) -> None:
    """Add an option that names a file or a folder."""
    parser.add_argument(option, metavar=metavar, help=what, **more)


def add_clutter_option(parser: argparse.ArgumentParser, effect: str) -> None:
    """Add ``--clutter``, which says what becomes of what stands still."""
    parser.add_argument(
        "--clutter",
        choices=("keep", "remove"),
        default="keep",
        help=f"objects that stand still: {effect}, together with a receiver's settling transient, "
        "as the median over the ramps (default: keep)",
    )


def add_out(parser: Any, what: str, metavar: str = "FILE") -> None:
    """Add ``--out``, which must be given."""
    add_file(parser, "--out", what, metavar, required=True)


def add_frames(parser: Any, more: str = "") -> None:
    """Add the frame files, at least one."""
    parser.add_argument("frames", nargs="+", metavar="FRAME", help=f"a frame file, *.npz{more}")


def add_antenna_option(parser: Any, default: str = "0") -> None:
    """Add ``--antenna``, for frame files that hold several."""
    what = f"which antenna of a frame file that holds several, from 0 (default: {default})"
    add_number(parser, "--antenna", what, int)


def add_scheduler_option(parser: Any, more: str = "") -> None:
    """Add ``--scheduler``, the workers of a Dask cluster in place of processes of this machine."""
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help=f"use the workers of this Dask scheduler, such as tcp://host:8786{more}",
    )
