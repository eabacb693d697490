"""The one loop: iterate an estimator, or run it to its end."""

import math
from collections.abc import Callable, Iterator

import numpy as np

from vsep._typing import ComplexArray
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import IterationInfo, Solution, Step, Termination
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import stopwatch, summed, with_rest
from vsep.kernels.clock import computing_s


def iterate(
    estimator: Estimator, received: ComplexArray, state: SeparationState | None = None
) -> Iterator[Step]:
    """Yield every iteration until the estimator terminates.

    Leaving the loop pauses the run; handing the last state back resumes it, bit for bit.

    Parameters
    ----------
    estimator : Estimator
        Settings and step function.
    received : (P, N) complex
        The frame, in the paper's sign.
    state : SeparationState, optional
        Where to resume.

    Yields
    ------
    Step
        State, diagnostics, termination and the seconds the step took.

    Raises
    ------
    InputError
        If the frame cannot be used.
    """
    received = estimator.model.check(received)
    state = estimator.init(received) if state is None else state
    while True:
        step = guarded_step(estimator, received, state)
        yield step
        if step.termination is not Termination.RUNNING:
            return
        state = step.state


def guarded_step(estimator: Estimator, received: ComplexArray, state: SeparationState) -> Step:
    """One step, timed; a numerical breakdown becomes ``Termination.NONFINITE``, not an exception.

    On breakdown the step carries the last good state.
    """
    start = computing_s()
    try:
        with stopwatch() as parts, np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            new_state, info = estimator.step(received, state)
        # A value that is not finite spreads to lambda and the bound within a step.
        sound = math.isfinite(new_state.noise_precision) and math.isfinite(info.elbo)
    except np.linalg.LinAlgError:
        sound = False
    seconds = computing_s() - start
    if not sound:
        return Step(
            state=state, info=_no_info(), termination=Termination.NONFINITE, seconds=seconds
        )
    return Step(
        state=new_state,
        info=info,
        termination=estimator.terminate(new_state, info),
        seconds=seconds,
        seconds_by_part=with_rest(parts, seconds),
    )


def _no_info() -> IterationInfo:
    return IterationInfo(
        elbo=float("nan"),
        events=(),
        max_frequency_change=float("nan"),
        noise_precision_change=float("nan"),
        searched=False,
        separability_ratio_db=float("nan"),
    )


def run(
    estimator: Estimator,
    received: ComplexArray,
    state: SeparationState | None = None,
    *,
    watch: Callable[[Step], None] | None = None,
) -> Solution:
    """Iterate to the end and return the last state with all diagnostics.

    Parameters
    ----------
    estimator, received, state
        As for `iterate`.
    watch : callable, optional
        Is told every step; its own time does not count.

    Returns
    -------
    Solution
        ``seconds`` is the time of the steps alone.
    """
    infos, parts = [], []
    seconds = 0.0
    for step in iterate(estimator, received, state):
        infos.append(step.info)
        parts.append(step.seconds_by_part)
        seconds += step.seconds
        if watch is not None:
            watch(step)
    return Solution(
        state=step.state,
        termination=step.termination,
        infos=tuple(infos),
        seconds=seconds,
        seconds_by_part=summed(parts),
    )
