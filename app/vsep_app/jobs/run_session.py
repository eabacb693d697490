"""A run as an explicit state machine: what may happen next, and what a late result means.

`RunSession` computes nothing and knows no clock, thread or browser. It hands out one `Job` at a
time and takes its outcome back under the number of the run that asked for it; an outcome of an
older run is dropped. All steps of a run are kept, so that stepping back and scrubbing only move a
cursor, and running on from an earlier iteration first shows the steps that are there. Of a very
long run some are kept without what it takes to show them. Commands and outcomes may come from
different threads: each is taken whole before the next.
"""

import enum
import functools
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Concatenate, Generic, ParamSpec, Protocol, TypeVar

from vsep.inference.core.progress import Termination
from vsep_app.jobs.weak_memo import WeakMemo

MAX_KEPT = 128


class Phase(enum.Enum):
    """What the session is doing; the value is what a user reads."""

    IDLE = "ready"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"


class JobKind(enum.Enum):
    """What a job asks for."""

    PREPARE = "make the scene and the first state"
    ADVANCE = "compute the next step"
    REPLAY = "show the next of the steps that are there"


class PreparedRun(Protocol):
    """Outcome of preparing a run; the session needs its first state only."""

    @property
    def initial_state(self) -> Any:
        """State of iteration 0."""


class AnyStep(Protocol):
    """Outcome of an iteration; the session hands its state to the next one."""

    @property
    def state(self) -> Any:
        """State after the iteration."""

    @property
    def termination(self) -> Termination:
        """Whether the run has ended here, and why."""


PreparedT = TypeVar("PreparedT", bound=PreparedRun)
StepT = TypeVar("StepT", bound=AnyStep)
PlanT = TypeVar("PlanT")
_Options = ParamSpec("_Options")
_Result = TypeVar("_Result")
_Self = TypeVar("_Self", bound="RunSession[Any, Any, Any]")


def _whole(
    method: Callable[Concatenate[_Self, _Options], _Result],
) -> Callable[Concatenate[_Self, _Options], _Result]:
    """Let a method of a session run to its end before another thread's call begins."""

    @functools.wraps(method)
    def call(session: _Self, /, *arguments: _Options.args, **named: _Options.kwargs) -> _Result:
        with session.lock:
            return method(session, *arguments, **named)

    return call


@dataclass(frozen=True, kw_only=True)
class Job(Generic[PlanT, PreparedT]):
    """Work to be done outside of the session."""

    run_number: int  #: The run that asks.
    kind: JobKind  #: What is asked for.
    plan: PlanT  #: What determines the run.
    prepared_run: PreparedT | None = None  #: The prepared run; None while it is to be prepared.
    state: Any = None  #: The state to advance from; None while the run is to be prepared.
    iteration: int = 0  #: The iteration that an advance leads to.
    #: Whether `state` is as it was computed, not what is kept of it for the display.
    is_exact: bool = True


@dataclass(frozen=True, kw_only=True)
class Snapshot(Generic[PreparedT, StepT]):
    """What a view needs: the prepared run, the steps up to the cursor, and how many there are."""

    run_number: int
    prepared_run: PreparedT
    steps: tuple[StepT, ...]
    num_steps: int
    phase: Phase


class RunSession(Generic[PlanT, PreparedT, StepT]):
    """One user's run: idle, running, paused or finished.

    Parameters
    ----------
    compact : WeakMemo or None
        Makes of a step what is kept of it once the next one is there; None keeps all.
    strip : callable or None
        Makes of a step what is kept of it where a run is too long to keep all its steps: enough to
        go on with the log, not enough to show it.
    most_kept : int
        So many steps of a run can be shown, evenly spread; of the others
        only what later pictures need is kept.
    """

    def __init__(
        self,
        compact: WeakMemo[StepT] | None = None,
        strip: Callable[[StepT], StepT] | None = None,
        *,
        most_kept: int = MAX_KEPT,
    ) -> None:
        self.lock = threading.RLock()
        self._compact, self._strip = compact, strip
        self.most_kept = most_kept
        self._stride, self._hidden = 1, set[int]()
        self.phase = Phase.IDLE
        self.run_number = 0
        self.cursor = 0
        self._steps: list[StepT] = []
        self._plan: PlanT | None = None
        self._prepared_run: PreparedT | None = None
        self._single_step = False
        self._stop_at: int | None = None
        #: Whether the run stands still, whatever it is told, until it is let go.
        self.is_held = False

    @property
    def num_steps(self) -> int:
        """Number of iterations computed so far in this run."""
        return len(self._steps)

    @property
    def prepared_run(self) -> PreparedT | None:
        """The prepared run, None until it is prepared."""
        return self._prepared_run

    @property
    def termination(self) -> Termination:
        """Termination at the cursor."""
        with self.lock:
            return self._steps[self.cursor - 1].termination if self.cursor else Termination.RUNNING

    @_whole
    def restart(self, plan: PlanT) -> None:
        """Begin a new run of `plan` at once; whatever is under way becomes stale."""
        self._plan = plan
        self._prepared_run = None
        self._begin(Phase.RUNNING)

    @_whole
    def reset(self) -> None:
        """Go back to iteration 0 of the same scene and forget the steps."""
        self._begin(Phase.IDLE)

    @_whole
    def run(self) -> None:
        """Go on from the cursor, unless the run has ended there."""
        self._single_step = False
        self._stop_at = None
        if not self._ended():
            self.phase = Phase.RUNNING

    @_whole
    def run_to(self, iteration: int) -> None:
        """Go on to an iteration and pause there; the run may end before.

        One of which too little is kept to show it is computed again, with those before.
        """
        if iteration in self._hidden:
            self._begin(Phase.RUNNING)
            self._stop_at = iteration
        elif iteration <= self.cursor:
            self.scrub(iteration)
        else:
            self.run()
            self._stop_at = iteration

    @property
    def is_on_its_way(self) -> bool:
        """Whether the run goes on to an iteration at which it will pause."""
        return self.phase is Phase.RUNNING and self._stop_at is not None

    @_whole
    def pause(self) -> None:
        """Stop after the step that is under way."""
        self._single_step = False
        if self.phase is Phase.RUNNING:
            self._settle()

    @_whole
    def step(self) -> None:
        """Go on by one iteration."""
        if not self._ended():
            self.phase = Phase.PAUSED
            self._single_step = True

    @_whole
    def step_back(self) -> None:
        """Show the iteration before the one shown."""
        before = self.cursor - 1
        while before in self._hidden:
            before -= 1
        self.scrub(before)

    @_whole
    def scrub(self, iteration: int) -> None:
        """Show any iteration so far, or the next one that is kept; 0 is before the first one."""
        self._single_step = False
        self.cursor = min(max(iteration, 0), len(self._steps))
        while self.cursor in self._hidden:
            self.cursor += 1
        self._settle()

    @_whole
    def next_job(self) -> Job[PlanT, PreparedT] | None:
        """Return the work to be done next, None when there is nothing to do."""
        if self._plan is None:
            return None
        if self._prepared_run is None:
            return Job(run_number=self.run_number, kind=JobKind.PREPARE, plan=self._plan)
        if self.is_held or not (self._single_step or self.phase is Phase.RUNNING):
            return None
        kind = JobKind.REPLAY if self.cursor < len(self._steps) else JobKind.ADVANCE
        state = self._steps[-1].state if self._steps else self._prepared_run.initial_state
        return Job(
            run_number=self.run_number,
            kind=kind,
            plan=self._plan,
            prepared_run=self._prepared_run,
            state=state,
            iteration=len(self._steps) + 1,
            is_exact=not (self._compact and self._steps and self._compact.made(self._steps[-1])),
        )

    @_whole
    def prepared(self, job: Job[PlanT, PreparedT], prepared_run: PreparedT) -> bool:
        """Take a prepared run; return False if it is stale."""
        if job.run_number != self.run_number:
            return False
        self._prepared_run = prepared_run
        return True

    @_whole
    def advanced(self, job: Job[PlanT, PreparedT], step: StepT) -> bool:
        """Take a computed step; return False if it is stale.

        A step that was under way when the user paused or scrubbed is kept, as it will be the next
        one in any case, but the cursor stays where the user left it.
        """
        if job.run_number != self.run_number:
            return False
        at_end = self.cursor == len(self._steps)
        if self._compact is not None and self._steps:
            self._steps[-1] = self._compact(self._steps[-1])
        self._steps.append(step)
        if at_end and (self._single_step or self.phase is Phase.RUNNING):
            self._move_on()
        self._hide_some()
        return True

    @_whole
    def replayed(self, job: Job[PlanT, PreparedT]) -> bool:
        """Show the next of the steps that are there; return False if the job is stale."""
        if job.run_number != self.run_number or self.cursor >= len(self._steps):
            return False
        self._move_on()
        return True

    @_whole
    def failed(self, job: Job[PlanT, PreparedT]) -> bool:
        """Take note that a job failed: no run can be prepared, or it stops where it is."""
        if job.run_number != self.run_number:
            return False
        self._single_step = False
        if job.kind is JobKind.PREPARE:
            self._plan = None
            self.phase = Phase.IDLE
        else:
            self.phase = Phase.PAUSED
        return True

    @_whole
    def snapshot(self) -> Snapshot[PreparedT, StepT] | None:
        """Return what a view needs, None until the run is prepared."""
        if self._prepared_run is None:
            return None
        return Snapshot(
            run_number=self.run_number,
            prepared_run=self._prepared_run,
            steps=tuple(self._steps[: self.cursor]),
            num_steps=len(self._steps),
            phase=self.phase,
        )

    def _begin(self, phase: Phase) -> None:
        self.run_number += 1
        self.cursor = 0
        self._steps = []
        self._stride, self._hidden = 1, set()
        self._single_step = False
        self._stop_at = None
        self.phase = phase

    def _move_on(self) -> None:
        self.cursor += 1
        while self.cursor in self._hidden:
            self.cursor += 1
        if self._single_step or self._ended() or self.cursor == self._stop_at:
            self._single_step = False
            self._stop_at = None
            self._settle()

    def _hide_some(self) -> None:
        """Keep only every second, fourth, ... step whole, so that a long run stays small."""
        if self._strip is None:
            return
        last = len(self._steps)
        while last // self._stride > self.most_kept:
            self._stride *= 2
        for iteration in range(1, last):
            shown = iteration % self._stride == 0 or iteration == self.cursor
            if not shown and iteration not in self._hidden:
                self._hidden.add(iteration)
                self._steps[iteration - 1] = self._strip(self._steps[iteration - 1])

    def _settle(self) -> None:
        self.phase = Phase.FINISHED if self._ended() else Phase.PAUSED

    def _ended(self) -> bool:
        at_end = self.cursor == len(self._steps)
        return at_end and self.termination is not Termination.RUNNING
