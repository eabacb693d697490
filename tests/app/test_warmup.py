"""After the first use nothing is left to be compiled."""

import subprocess
import sys

# In a process of its own: in this one other tests have loaded what may be forgotten.
CODE = """
from importlib import import_module
from pkgutil import walk_packages
import vsep
from vsep_app.jobs.warmup import compile_everything
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.map_spec import MapSpec
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel

def called():
    # How often the kernels are compiled that modules outside of vsep.kernels call.
    names = {module.name for module in walk_packages(vsep.__path__, "vsep.")} - {"vsep.__main__"}
    modules = [import_module(name) for name in names if not name.startswith("vsep.kernels.")]
    found = {}
    for module in modules:
        for name, value in vars(module).items():
            if hasattr(value, "signatures"):
                found[module.__name__, name] = len(value.signatures)
    return found

compile_everything()
before = called()
assert len(before) > 20, before
assert all(before.values()), {key for key, count in before.items() if not count}
for preset, snr_db in (("simulation-1", 30.0), ("simulation-2-c", 60.0)):
    scenario, observation = simulate_preset(preset, snr_db=snr_db, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    run(FactorisedSeparator(model=model), observation.received)
for axes in (("sir_db=-40:0:3", "snr_db=20:60:3"),
             ("object_delay_s=1e-7:2e-7:2", "slope_difference_hz_per_s=-2e12:2e12:2"),
             ("filter_cutoff_hz=1e6:2e6:2", "interfered_share=0.1:0.4:2")):
    x, y = map(parse_axis, axes)
    analytic_map(MapSpec(x=x, y=y, scene="simulation-2-c"))
assert called() == before, {key for key, count in called().items() if before.get(key) != count}
"""


def test_after_the_first_use_nothing_is_compiled():
    subprocess.run([sys.executable, "-c", CODE], check=True, timeout=300)
