"""Rows of studies that the program ships, so that a figure is there before anything is run."""

import gzip
import shutil
from pathlib import Path

from vsep_app.assets import path as asset


def copy_shipped_rows(name: str, path: Path) -> bool:
    """Copy the shipped rows of a study to where a session of it looks for them.

    Rows that are there already stay.

    Parameters
    ----------
    name : str
        Name of the study.
    path : Path
        File of a session's rows.

    Returns
    -------
    bool
        Whether the file is there now.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    if path.exists():
        return True
    try:
        shipped = asset(f"results/rows/{name}.jsonl.gz")
    except FileNotFoundError:
        return False
    beside = path.with_suffix(".part")
    with gzip.open(shipped, "rb") as source, beside.open("wb") as target:
        shutil.copyfileobj(source, target)
    beside.rename(path)
    return True
