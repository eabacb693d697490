"""Captures of a folder that is being written: each once, as soon as it is complete.

A capture counts as complete when its size has not changed from one look at the folder to the next.
"""

import os
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from vsep.errors import InputError
from vsep.recordings.readers import READERS
from vsep.recordings.sigmf_files import DATA

SUFFIXES: Final = frozenset(
    {".bin", ".dat", ".raw", ".bag"}
    | {suffix for reader in READERS.values() for suffix in reader.suffixes if suffix != DATA}
)
MOST_FILES: Final = 65536


@dataclass(frozen=True, kw_only=True, slots=True)
class FolderState:
    """What has been seen of a folder."""

    sizes: Mapping[str, int] = field(default_factory=dict)  #: of files that may still grow
    done: frozenset[str] = frozenset()  #: files that were returned


def existing(folder: str | Path) -> FolderState:
    """Return the state in which all that is in a folder has been seen.

    Raises `InputError` if it is no folder.
    """
    return FolderState(done=frozenset(_sizes(folder)))


def next_captures(
    folder: str | Path, state: FolderState
) -> tuple[FolderState, tuple[tuple[str, float], ...]]:
    """Look at a folder once more.

    Parameters
    ----------
    folder : str or Path
        Where captures are written to.
    state : FolderState
        That of the look before.

    Returns
    -------
    state : FolderState
        For the next look.
    captures : tuple of (str, float)
        Paths of captures that are complete and were not returned before, the earliest first, and
        when they were written, in seconds.

    Raises
    ------
    InputError
        If it is no folder, or holds too many files.
    """
    found = _sizes(folder)
    new = {path: size for path, (size, _) in found.items() if path not in state.done}
    complete = [path for path, size in new.items() if size and state.sizes.get(path) == size]
    complete.sort(key=lambda path: (found[path][1], path))
    left = {path: size for path, size in new.items() if path not in complete}
    # What was removed may come again under its name.
    done = (state.done & found.keys()) | set(complete)
    return (
        FolderState(sizes=left, done=frozenset(done)),
        tuple((path, found[path][1]) for path in complete),
    )


def copy_captures(captures: Iterable[str], folder: str | Path) -> int:
    """Copy captures that are still there into a folder, made if need be; return their number.

    Raises `OSError` if it cannot be written.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    present = [capture for capture in captures if Path(capture).is_file()]
    for capture in present:
        shutil.copy2(capture, folder)
    return len(present)


def _sizes(folder: str | Path) -> dict[str, tuple[int, float]]:
    """Sizes and times of the captures in a folder."""
    found: dict[str, tuple[int, float]] = {}
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                if entry.name.startswith(".") or Path(entry.name).suffix.lower() not in SUFFIXES:
                    continue
                try:
                    if entry.is_file(follow_symlinks=False):
                        status = entry.stat(follow_symlinks=False)
                        found[entry.path] = status.st_size, status.st_mtime
                except FileNotFoundError:
                    continue  # removed while the folder was read
                if len(found) > MOST_FILES:
                    raise InputError(f"{folder} holds more than {MOST_FILES} captures.")
    except OSError as error:
        raise InputError(f"{folder} cannot be watched: {error.strerror}.") from error
    return found
