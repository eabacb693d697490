import numpy as np
import pytest

from vsep.analysis.burst_model import burst_signal, model_bursts
from vsep.presets.registry import PRESET_NAMES
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel

NO_MODEL = {"moving-car", "extended-car", "phase-coded", "dithered-ramps"}


# A phase code is no chirp.
# A dithered ramp may end just as a chirp comes near the band: the filter's skirt, and no burst.
# The chirps of the moving car's neighbour end inside of a ramp: no product of a chirp and lines.
@pytest.mark.parametrize("name", [name for name in PRESET_NAMES if name not in NO_MODEL])
def test_the_multiplicative_model_is_written_exactly(name):
    scenario, observation = simulate_preset(name, snr_db=60.0, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    true = observation.truth.interference_signal
    bursts = model_bursts(scenario.radar, scenario.scene.interferers, model, true)
    assert [b.ramp for b in bursts] == [b.ramp for b in observation.truth.bursts]
    rest = np.linalg.norm(burst_signal(bursts, model) - true) / np.linalg.norm(true)
    # Phases of 1e4 turns in double precision, made in two ways: 1e4 x 2 pi x 2e-16 = 1e-11.
    assert rest < 1e-11


def test_a_scene_without_interferers_has_no_bursts():
    scenario, observation = simulate_preset(
        "simulation-1", snr_db=30.0, sir_db=0.0, seed=0, interference=False
    )
    model = SignalModel(
        num_ramps=1,
        num_samples=256,
        sample_rate_hz=scenario.radar.sample_rate_hz,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
    )
    signal = observation.truth.interference_signal
    assert model_bursts(scenario.radar, (), model, signal) == ()
    assert not np.any(burst_signal((), model))
