"""Session of a study in the background of the dashboard: start, snapshot, stop, resume.

The engine is that of the command line and so is the file: what one has begun, the other continues.
One thread follows the engine; readers take snapshots. Nothing is drawn here.
"""

import enum
import logging
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from vsep.errors import InputError
from vsep.studies.engine import finished_keys, record_study
from vsep.studies.rows import read_rows, study_of_rows
from vsep.studies.study import Study
from vsep.studies.trial import FAILED, Row, is_missing
from vsep_app.jobs.worker import Limited

_LOG = logging.getLogger(__name__)

# Fewer say nothing of the pace: the processes have to start.
_MIN_ROWS = 4


class StudyPhase(enum.Enum):
    """What a study is doing; the value is what a user reads."""

    STOPPED = "stopped"
    RUNNING = "running"
    STOPPING = "stopping"
    FINISHED = "finished"
    BROKEN = "ended by an error"


@dataclass(frozen=True, kw_only=True)
class StudySnapshot:
    """How far a study is."""

    phase: StudyPhase  #: What it is doing.
    rows: tuple[Row, ...]  #: All rows so far, in the order in which they came.
    num_rows: int  #: How many there will be.
    num_failed: int  #: How many have no result.
    #: Time left at the pace of this run; None while that cannot be said.
    left_s: float | None = None
    error: str = ""  #: Why it ended, if it is broken.


class StudySession:
    """One study, the file of its rows, and the number of local processes.

    Raises `InputError` if the file holds something else.
    """

    def __init__(self, study: Study, path: Path, *, workers: int = 1) -> None:
        self._study, self._path, self._workers = study, path, workers
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._error = ""
        self._start = 0.0, 0
        finished = finished_keys(study, path)
        self._rows: list[Row] = self._own_rows() if finished else []
        self._phase = self._resting_phase()

    def start(self) -> None:
        """Run what is missing; nothing happens if it runs already or is finished."""
        with self._lock:
            if self._phase not in (StudyPhase.STOPPED, StudyPhase.BROKEN):
                return
            self._phase, self._error = StudyPhase.RUNNING, ""
            self._rows = [row for row in self._rows if not is_missing(row)]
            self._start = time.monotonic(), len(self._rows)
            self._stop.clear()
            self._thread = threading.Thread(target=self._follow, daemon=True)
            self._thread.start()

    def stop(self) -> None:
        """Stop at once; the trials that are at work are lost and made again later."""
        with self._lock:
            if self._phase is StudyPhase.RUNNING:
                self._phase = StudyPhase.STOPPING
                self._stop.set()

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait until it neither runs nor stops."""
        if self._thread is not None:
            self._thread.join(timeout_s)

    @property
    def is_busy(self) -> bool:
        """Whether it runs or is about to stop."""
        return self._phase in (StudyPhase.RUNNING, StudyPhase.STOPPING)

    def snapshot(self) -> StudySnapshot:
        """Return how far it is now."""
        with self._lock:
            rows = tuple(self._rows)
            phase, error = self._phase, self._error
            started, before = self._start
        left_s = None
        if phase is StudyPhase.RUNNING:
            missing = self._study.num_rows - len(rows)
            left_s = time_left_s(time.monotonic() - started, len(rows) - before, missing)
        return StudySnapshot(
            phase=phase,
            rows=rows,
            num_rows=self._study.num_rows,
            num_failed=sum(row["status"] == FAILED for row in rows),
            left_s=left_s,
            error=error,
        )

    def _follow(self) -> None:
        """Take rows from the engine until it ends or a stop is asked for; the thread's body."""
        error = ""
        try:
            for rows in record_study(
                self._study, self._path, workers=self._workers, stop=self._stop
            ):
                with self._lock:
                    self._rows.extend(rows)
        except Exception as problem:
            error = _sentence(problem)
        with self._lock:
            self._error = error
            self._phase = StudyPhase.BROKEN if error else self._resting_phase()

    def _resting_phase(self) -> StudyPhase:
        whole = sum(not is_missing(row) for row in self._rows) >= self._study.num_rows
        return StudyPhase.FINISHED if whole else StudyPhase.STOPPED

    def _own_rows(self) -> list[Row]:
        """Rows of the file that belong to the study as it is asked for now."""
        study = self._study
        indices, methods = set(study.point_indices), set(study.methods)
        return [
            row
            for row in read_rows(self._path)
            if row["study"] == study.name
            and row["point_index"] in indices
            and row["realization"] < study.realizations
            and row["method"] in methods
        ]


def time_left_s(spent_s: float, num_made: int, num_missing: int) -> float | None:
    """Return how long the missing rows take at the pace of those made; None if it is too early.

    Examples
    --------
    >>> time_left_s(10.0, 20, 60)
    30.0
    """
    return None if num_made < _MIN_ROWS else spent_s / num_made * num_missing


def _sentence(problem: Exception) -> str:
    """Say in one sentence what ended a study; what nobody foresaw goes to the log as well."""
    if isinstance(problem, InputError | OSError):
        return str(problem)
    _LOG.error("a study failed", exc_info=problem)
    return f"The study ended by an error ({type(problem).__name__}: {problem})."


def keep_rows(path: Path, content: bytes, name: str) -> Study:
    """Write rows that were uploaded into a file and return their study.

    Raises `InputError` if they are no rows of a study, or cannot be drawn; it says so under the
    user's name.
    """
    path.write_bytes(content)
    try:
        return study_of_rows(read_rows(path), path)
    except InputError as error:
        raise InputError(str(error).replace(str(path), name)) from error


KEEP_ROWS = Limited(function=keep_rows, what="The file of rows", seconds=30.0, megabytes=1024)
