"""After the first use nothing is left to be compiled."""

import subprocess
import sys

# In a process of its own: here other tests have loaded what the first use may have forgotten.
CODE = """
import sys
from vsep.first_use import compile_everything
from vsep.inference.run import run
from vsep.inference.separator import FactorisedSeparator
from vsep.signal.presets import simulate_preset
from vsep.signal.template import SignalModel

def loaded():
    modules = [m for name, m in sys.modules.items() if name.startswith("vsep.kernels.")]
    found = {}
    for module in modules:
        for name, value in vars(module).items():
            if hasattr(value, "signatures"):
                found[module.__name__, name] = len(value.signatures)
    return found

compile_everything()
before = loaded()
assert sum(before.values()) > 20
for preset, snr_db in (("simulation-1", 30.0), ("simulation-2-c", 60.0)):
    scenario, observation = simulate_preset(preset, snr_db=snr_db, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    run(FactorisedSeparator(model=model), observation.received)
assert loaded() == before, {key for key, count in loaded().items() if before.get(key) != count}
"""


def test_a_separation_after_the_first_use_compiles_nothing():
    subprocess.run([sys.executable, "-c", CODE], check=True, timeout=300)
