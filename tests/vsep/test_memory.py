"""What a run of Simulation II takes above the modules it needs, in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

STATUS = Path("/proc/self/status")
PROGRAM = f"""
import json
from pathlib import Path
from numba.core.registry import cpu_target  # loaded with the first kernel otherwise
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel

def megabytes():
    return int(Path("{STATUS}").read_text().split("VmHWM:")[1].split()[0]) / 1024.0

cpu_target.target_context
before = megabytes()
scenario, observation = simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-20.0, seed=1)
model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
marks = [before]
for _ in range(2):
    run(FactorisedSeparator(model=model), observation.received)
    marks.append(megabytes())
print(json.dumps(marks))
"""

pytestmark = pytest.mark.skipif(not STATUS.exists(), reason="no memory is told on this system")


@pytest.mark.usefixtures("compiled_kernels")
def test_a_run_takes_little_more_than_its_kernels_do():
    command = [sys.executable, "-W", "error", "-c", PROGRAM]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    before, first, second = json.loads(told)
    # Measured 49 MB, of which Numba's own are most when it loads its first kernel. With all that
    # compiles it was 58, with the intermediate code of the kernels too 80; in between is room for
    # other allocators.
    assert first - before < 57.0
    assert second - first < 3.0
