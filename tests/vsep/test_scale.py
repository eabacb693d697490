"""A frame of 128 ramps x 512 samples with a hundred objects: what is found, and in how much memory.

The run is in a process of its own, whose largest memory is its own too.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from vsep.units import wrap_frequency

NUM_RAMPS, NUM_SAMPLES, NUM_OBJECTS, NUM_BURSTS, SEED = 128, 512, 100, 32, 4
STATUS = Path("/proc/self/status")
PROGRAM = f"""
import json
from pathlib import Path
from tests.benchmarks.scenes import drawn_problem
from vsep.inference.core.run import run

problem = drawn_problem(({NUM_RAMPS}, {NUM_SAMPLES}), {NUM_OBJECTS}, {NUM_BURSTS}, seed={SEED})
solution = run(problem.separator, problem.received)
print(json.dumps({{
    "beats": solution.objects.beats.tolist(),
    "dopplers": solution.objects.dopplers.tolist(),
    "ramps": list(solution.state.interfered_ramps),
    "converged": solution.termination.name,
    # Not what `resource` tells: there the process that started this one counts too.
    "kilobytes": int(Path("{STATUS}").read_text().split("VmHWM:")[1].split()[0]),
}}))
"""


pytestmark = pytest.mark.skipif(not STATUS.exists(), reason="no memory is told on this system")


@pytest.fixture(scope="module")
def outcome(compiled_kernels):
    del compiled_kernels
    command = [sys.executable, "-W", "error", "-c", PROGRAM]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def test_every_object_is_found_and_no_other(outcome):
    rng = np.random.default_rng(SEED)  # the first draws of the scene
    beats, dopplers = rng.uniform(0.0, 0.45, NUM_OBJECTS), rng.uniform(-0.5, 0.5, NUM_OBJECTS)
    found = np.array(outcome["beats"]), np.array(outcome["dopplers"])
    cells = np.hypot(
        NUM_SAMPLES * wrap_frequency(found[0][:, None] - beats),
        NUM_RAMPS * wrap_frequency(found[1][:, None] - dopplers),
    )
    # The weakest object is 10 dB below the strongest, some 35 dB in the frame: its deviation is
    # a hundredth of a cell; 0.05 false alarms a frame are asked for.
    assert np.count_nonzero(cells.min(axis=0) < 0.25) == NUM_OBJECTS
    assert np.count_nonzero(cells.min(axis=1) >= 0.25) <= 1


def test_every_burst_is_found_and_no_other(outcome):
    assert outcome["ramps"] == list(range(NUM_BURSTS))
    assert outcome["converged"] == "CONVERGED"


def test_memory(outcome):
    assert outcome["kilobytes"] < 1000.0 * 1024.0
