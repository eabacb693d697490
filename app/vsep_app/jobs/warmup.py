"""The inner loops are translated to machine code on their first use; get that over with.

``python -m vsep_app.jobs.warmup`` does it after an installation, in a minute or two. The result is
kept on disk: afterwards the same takes a fraction of a second. Without it, what is called is
compiled on its first use, which no measured time counts.
"""

from concurrent.futures import Future

import numpy as np

from vsep._processes import worker_pool
from vsep._typing import ComplexArray
from vsep.inference.core.run import run
from vsep.inference.deviations import state_deviations
from vsep.inference.registry import make_estimator
from vsep.presets.scenes import Scenario, simulate_preset
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.map_spec import MapSpec
from vsep.signal.filters import ButterworthFilter, RaisedCosineFilter
from vsep.signal.scene import Observation
from vsep.signal.template import SignalModel

# Of another kind than the frame's: it is to be corrected.
_WRONG_FILTER = RaisedCosineFilter(cutoff_hz=1.275e6, rolloff=0.25)
_ITERATIONS = 8  # search, bursts, channels, weights, the filter's correction and objects had a turn


def compile_everything() -> None:
    """Run a few iterations of every estimator on a frame that needs all, and draw a small map."""
    scenario, observation = _frame()
    for assumed in (scenario.anti_aliasing_filter, _WRONG_FILTER):
        model = SignalModel.of_radar(scenario.radar, assumed)
        for name in ("factorised", "joint"):
            _separate(name, model, observation.received)
    several = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter, 2)
    _separate("factorised", several, np.stack([observation.received] * several.num_antennas))
    _compile_map()
    _compile_moving()
    _compile_dithered()


def compile_side_by_side() -> None:
    """Do the same in two processes: one begins with objects and map, the other with the bursts.

    What one of them has compiled the other reads from the disk.
    """
    with worker_pool(2) as pool:
        jobs: list[Future[None]] = [pool.submit(_compile_others), pool.submit(compile_everything)]
        for job in jobs:
            job.result()


def separate_one_frame() -> None:
    """Load what a process needs to separate, a second or so; its next frame is quick.

    After an installation that much is compiled, and nothing that other estimators or maps need.
    """
    scenario, observation = _frame()
    model = SignalModel.of_radar(scenario.radar, _WRONG_FILTER)
    _separate("factorised", model, observation.received)


def _compile_others() -> None:
    _compile_map()
    _compile_moving()
    scenario, observation = _frame()
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    _separate("object-only", model, observation.received)


def _separate(name: str, model: SignalModel, received: ComplexArray) -> None:
    run(make_estimator(name, model, max_iterations=_ITERATIONS), received)


def _compile_map() -> None:
    x, y = parse_axis("sir_db=-20:0:2"), parse_axis("object_delay_s=1e-7:2e-7:2")
    analytic_map(MapSpec(x=x, y=y))


def _compile_moving() -> None:
    """Separate a frame of an object that moves through range cells, and tell its deviations."""
    scenario, observation = simulate_preset(
        "moving-car", snr_db=62.0, sir_db=0.0, seed=1, interference=False, iq_gain_db=1.0
    )
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    state = run(make_estimator("object-only", model, max_iterations=4), observation.received).state
    state_deviations(state, model.shape, model.migration)


def _compile_dithered() -> None:
    """Separate a frame of dithered ramps."""
    scenario, observation = simulate_preset("dithered-ramps", snr_db=40.0, sir_db=-20.0, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    run(make_estimator("object-only", model, max_iterations=3), observation.received)


def _frame() -> tuple[Scenario, Observation]:
    return simulate_preset(
        "simulation-2-b",
        snr_db=60.0,
        sir_db=-20.0,
        seed=1,
        anti_aliasing_filter=ButterworthFilter(cutoff_hz=1.25e6, order=4),
        interference_model="convolution",
    )


if __name__ == "__main__":
    compile_side_by_side()
