"""The loop: timing, endings, and what a numerical breakdown does."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.run import guarded_step, iterate, run
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

MODEL = SignalModel(
    num_ramps=1, num_samples=64, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
)


class BreakingEstimator:
    """Fails in its second step, by an undefined bound or a factorisation that does not exist."""

    def __init__(self, failure):
        self.inner = ObjectOnlySeparator(model=MODEL)
        self.model, self.threshold_db, self.failure = MODEL, 10.0, failure

    def init(self, received):
        return self.inner.init(received)

    def step(self, received, state):
        if state.iteration == 1 and self.failure == "factorisation":
            raise np.linalg.LinAlgError("not positive definite")
        new_state, info = self.inner.step(received, state)
        if state.iteration == 1:
            info = IterationInfo(
                elbo=float("nan"),
                events=(),
                max_frequency_change=0.0,
                noise_precision_change=0.0,
                searched=False,
                separability_ratio_db=0.0,
            )
        return new_state, info

    def terminate(self, state, info):
        return self.inner.terminate(state, info) and Termination.RUNNING


@pytest.fixture
def received():
    rng = np.random.default_rng(3)
    noise = rng.standard_normal((1, 64)) + 1j * rng.standard_normal((1, 64))
    return 3.0 * np.exp(-2j * np.pi * 0.2 * np.arange(64))[None] + noise


@pytest.mark.parametrize("failure", ["factorisation", "undefined"])
def test_numerical_breakdown_ends_the_run_with_the_last_good_state(received, failure):
    steps = list(iterate(BreakingEstimator(failure), received))
    assert [step.termination for step in steps] == [Termination.RUNNING, Termination.NONFINITE]
    assert steps[1].state is steps[0].state


def test_other_mistakes_are_not_swallowed(received):
    estimator = ObjectOnlySeparator(model=MODEL)
    with pytest.raises(AttributeError):
        guarded_step(estimator, received, None)


def test_run_keeps_every_diagnostic_and_adds_up_the_seconds(received):
    solution = run(ObjectOnlySeparator(model=MODEL), received)
    assert len(solution.infos) == solution.iterations
    assert solution.seconds > 0.0
    assert solution.termination is Termination.CONVERGED


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (np.ones((2, 64)), r"received has shape \(2, 64\); it must be \(1, 64\)"),
        (np.zeros((1, 64)), "zero everywhere"),
        (np.full((1, 64), np.inf), "64 samples that are NaN or infinite"),
    ],
)
def test_unusable_frames_are_refused_before_the_first_step(frame, message):
    with pytest.raises(InputError, match=message):
        run(ObjectOnlySeparator(model=MODEL), frame)
