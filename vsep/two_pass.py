"""Separation in two passes: weak bursts are searched where the interferer's timing expects them.

The timing (`vsep.analysis.interferer_timing`) is fitted to the strong bursts of the frame itself:
another frame of the same radars begins at another time of both of their clocks, which nobody has
recorded. The run then goes on from where it has ended, and searches the predicted places that hold
no burst, see `vsep.inference.bursts.expected_bursts`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from vsep._typing import ComplexArray
from vsep.analysis.crossings import Crossings, InterfererTiming
from vsep.analysis.interferer_timing import fit_interferer_timings
from vsep.errors import InputError
from vsep.inference.bursts.expected_bursts import ExpectedBursts
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Solution, Step, Termination
from vsep.inference.core.run import run
from vsep.inference.core.state import BurstComponents
from vsep.inference.core.stopwatch import summed
from vsep.inference.factorised import FactorisedSeparator
from vsep.signal.radar import ChirpSequence

_MAX_ITERATIONS = 100_000
MIN_REACH: Final = 1.0
"""Samples by which a burst may miss its place, at least: a weak one is not known better."""


def require_timing_support(estimator: Estimator) -> FactorisedSeparator:
    """Return an estimator that searches bursts more than once; `InputError` if it does not."""
    if not isinstance(estimator, FactorisedSeparator) or estimator.schedule != "robust":
        raise InputError(
            "--interferer-timing needs an estimator that searches bursts again: factorised or "
            "joint, with the robust schedule."
        )
    return estimator


def run_twice(
    estimator: FactorisedSeparator,
    received: ComplexArray,
    radar: ChirpSequence,
    *,
    watch: Callable[[Step], None] | None = None,
) -> tuple[Solution, tuple[InterfererTiming, ...]]:
    """Run an estimator to its end, and on with what the interferers' timings predict.

    Parameters
    ----------
    estimator : FactorisedSeparator
        Settings; the second pass may take as many iterations as the first.
    received : (P, N) or (A, P, N) complex
        The frame.
    radar : ChirpSequence
        The victim.
    watch : callable, optional
        Is told every step of both passes.

    Returns
    -------
    Solution
        Of both passes together.
    tuple of InterfererTiming
        What was used; without one there was no second pass.
    """
    first = run(estimator, received, watch=watch)
    timings = fit_interferer_timings(crossings_of(first.state.bursts, radar), radar)
    expected = expected_of(timings, radar)
    if expected is None or first.termination is Termination.NONFINITE:
        return first, ()
    again = replace(
        estimator,
        expected_bursts=expected,
        max_iterations=min(first.iterations + estimator.max_iterations, _MAX_ITERATIONS),
    )
    second = run(again, received, replace(first.state, search_pending=True), watch=watch)
    both = Solution(
        state=second.state,
        termination=second.termination,
        infos=(*first.infos, *second.infos),
        seconds=first.seconds + second.seconds,
        seconds_by_part=summed([first.seconds_by_part, second.seconds_by_part]),
    )
    return both, timings


def crossings_of(bursts: Sequence[BurstComponents], radar: ChirpSequence) -> Crossings:
    """Crossings of bursts; one that several antennas received counts once.

    A burst without a channel component is none.
    """
    rate = radar.sample_rate_hz
    chirps = dict.fromkeys(
        (burst.ramp, burst.start_frequency * rate, burst.slope * rate**2)
        for burst in bursts
        if burst.num_components > 0
    )
    ramps, starts, slopes = np.array(list(chirps), dtype=np.float64).reshape(-1, 3).T
    return Crossings.of_chirps(ramps, starts, slopes, rate)


def expected_of(timings: Sequence[InterfererTiming], radar: ChirpSequence) -> ExpectedBursts | None:
    """Return where timings predict bursts, None if nowhere."""
    places = [timing.predicted() for timing in timings]
    if sum(len(each.ramps) for each in places) == 0:
        return None
    rate = radar.sample_rate_hz
    own = max(float(np.abs(timing.residuals).max()) for timing in timings)
    return ExpectedBursts(
        ramps=np.concatenate([each.ramps for each in places]),
        centres=np.concatenate([each.samples for each in places]),
        slopes=np.concatenate([each.slopes_hz_per_s for each in places]) / rate**2,
        reach=max(MIN_REACH, own),
    )
