"""Memory and processor time of processes, as Linux tells them."""

import contextlib
import os
from pathlib import Path

_MEGABYTE, _KILOBYTE = 1e6, 1024


def memory_mb(process_id: int) -> float | None:
    """Return the resident memory of a process; None where the system does not tell."""
    try:
        pages = int(Path(f"/proc/{process_id}/statm").read_text().split()[1])
    except OSError:
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / _MEGABYTE


def all_memory_mb(process_id: int) -> float | None:
    """Return what a process and all that it has started take together.

    Memory that they share counts once, which takes the system some milliseconds to find out.
    """
    try:
        rollup = Path(f"/proc/{process_id}/smaps_rollup").read_text()
    except OSError:
        return None
    total = int(rollup.partition("Pss:")[2].split()[0]) * _KILOBYTE / _MEGABYTE
    for path in Path(f"/proc/{process_id}/task").glob("*/children"):
        with contextlib.suppress(OSError):  # a thread that has just ended
            total += sum(all_memory_mb(int(child)) or 0.0 for child in path.read_text().split())
    return total


def cpu_s(process_id: int) -> float | None:
    """Return the processor time of a process; None where the system does not tell."""
    try:
        # The name of the process, in brackets, may hold blanks; user and system time follow it.
        words = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
