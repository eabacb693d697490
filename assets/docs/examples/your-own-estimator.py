"""Add an estimator of your own.

An estimator is a frozen record of settings with `init`, `step` and `terminate`; see
`vsep.inference.core.estimator`. `step` is a pure function of the frame and a state, so that a run
can be watched, paused and resumed like any other. This one limits samples far above the median, as
receivers with a soft limiter do, and looks for objects in what is left.
[Extending](../extending.md) says how a package of yours brings it to the command line, the pages
and the studies.
"""

from dataclasses import dataclass

import numpy as np

import vsep
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.state import SeparationState
from vsep.signal.template import SignalModel


@dataclass(frozen=True, kw_only=True)
class LimitedObjects:
    """Object estimation behind a limiter.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter.
    limit : float
        Largest magnitude that is let through, in medians of the frame.
    """

    model: SignalModel
    limit: float = 2.0

    @property
    def _objects(self) -> vsep.ObjectOnlySeparator:
        return vsep.ObjectOnlySeparator(model=self.model, max_iterations=20)

    @property
    def threshold_db(self) -> float:
        """Object threshold in force, dB."""
        return self._objects.threshold_db

    def limited(self, received: np.ndarray) -> np.ndarray:
        """Return the frame with its large samples cut down; phases stay."""
        magnitude = np.abs(received)
        return received * np.minimum(1.0, self.limit * np.median(magnitude) / magnitude)

    def init(self, received: np.ndarray) -> SeparationState:
        """State before the first step."""
        return self._objects.init(self.limited(received))

    def step(
        self, received: np.ndarray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One iteration: a pure function of its two arguments."""
        return self._objects.step(self.limited(received), state)

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Whether a run goes on after this step."""
        return self._objects.terminate(state, info)


vsep.check_estimator(LimitedObjects)  # the rules that every estimator keeps

scenario, observation = vsep.simulate_preset("simulation-1", snr_db=30.0, sir_db=-25.0, seed=4)
model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
estimators = {
    "object-only": vsep.ObjectOnlySeparator(model=model, max_iterations=20),
    "limited": LimitedObjects(model=model),
    "factorised": vsep.FactorisedSeparator(model=model),
}
(true_beat,) = observation.truth.beats
found = {}
for name, estimator in estimators.items():
    solution = vsep.run(estimator, observation.received)
    errors = np.abs(solution.objects.beats - true_beat) * scenario.radar.num_samples
    found[name] = bool(np.any(errors < 0.5))
    print(f"{name:<12} object found: {found[name]}, {solution.objects.num_components} components")

assert found == {"object-only": False, "limited": True, "factorised": True}
