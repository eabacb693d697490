"""After the first use nothing is left to be compiled."""

from numba.core import event

from vsep.first_use import compile_everything
from vsep.inference.run import run
from vsep.inference.separator import FactorisedSeparator
from vsep.signal.presets import simulate_preset
from vsep.signal.template import SignalModel


def test_a_separation_after_the_first_use_compiles_nothing():
    compile_everything()
    scenario, observation = simulate_preset("simulation-2-c", snr_db=60.0, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    with event.install_recorder("numba:compile") as recorder:
        run(FactorisedSeparator(model=model), observation.received)
    assert recorder.buffer == []
