"""Time of whole runs and single steps; `make bench` prints the table."""

import pytest

from vsep.inference.run import run
from vsep.inference.separator import FactorisedSeparator
from vsep.signal.presets import simulate_preset
from vsep.signal.template import SignalModel

CASES = [("simulation-1", 30.0, -15.0), ("simulation-2-c", 60.0, -20.0)]


def problem(name, snr_db, sir_db):
    scenario, observation = simulate_preset(name, snr_db=snr_db, sir_db=sir_db, seed=1)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    return FactorisedSeparator(model=model), observation.received


@pytest.mark.benchmark(group="whole run")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_whole_run(benchmark, case):
    separator, received = problem(*case)
    solution = benchmark(run, separator, received)
    assert solution.objects.num_components >= 1


@pytest.mark.benchmark(group="one step")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_step_with_burst_search(benchmark, case):
    separator, received = problem(*case)
    state = separator.init(received)
    state, info = benchmark(separator.step, received, state)
    assert info.searched


@pytest.mark.benchmark(group="one step")
@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_step_of_a_settled_run(benchmark, case):
    separator, received = problem(*case)
    settled = run(separator, received).state
    state, _ = benchmark(separator.step, received, settled)
    assert state.iteration == settled.iteration + 1
