"""`vsep.analysis.parallel`: an interferer of the same slope, and what is none."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.analysis.parallel import parallel_ramps
from vsep.presets.scenes import preset_radar, simulate_preset
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.radar import InterfererSequence
from vsep.signal.scene import Channel, Interferer, Scene
from vsep.signal.simulate import simulate

VALUES = {"start_frequency_hz": 77e9, "slope_hz_per_s": 3e13, "sample_rate_hz": 1e7}
RADAR = replace(preset_radar("simulation-2-a"), ramp_period_s=30e-6, num_ramps=32, **VALUES)
OBJECTS = Channel(
    delays_s=np.array([5e-8, 9e-8]),
    dopplers_hz=np.array([1e3, -8e3]),
    weights=np.array([1.0, 0.5j]),
)


@pytest.mark.parametrize("snr_db", [30.0, 60.0])
def test_the_same_slope_at_another_interval_is_recognised(snr_db: float) -> None:
    # Every third of the victim's ramps meets one of the other's; 4.3 MHz later than its own.
    sequence = InterfererSequence(
        start_frequency_hz=77e9 - 2.3e6,
        slope_hz_per_s=3e13,
        ramp_duration_s=29e-6,
        ramp_period_s=90e-6,
        num_ramps=11,
    )
    path = Channel(delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, complex))
    scene = Scene(
        objects=OBJECTS,
        interferers=(Interferer(sequence=sequence, channel=path),),
        snr_db=snr_db,
        sir_db=-10.0,
    )
    filtered = RaisedCosineFilter(cutoff_hz=4e6, rolloff=0.25)
    received = simulate(
        RADAR,
        scene,
        anti_aliasing_filter=filtered,
        interference_model="convolution-with-edges",
        rng=np.random.default_rng(1),
    ).received
    assert np.flatnonzero(parallel_ramps(received)).tolist() == list(range(0, 32, 3))


def test_crossing_bursts_and_objects_are_not_taken_for_it() -> None:
    for name in ("simulation-2-a", "simulation-2-b", "simulation-2-c"):
        _, observation = simulate_preset(name, snr_db=60.0, sir_db=-20.0, seed=4)
        assert not parallel_ramps(observation.received).any()


def test_noise_is_not_taken_for_it() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        # 2.5e5 noise samples, of which one in 1e9 is sudden.
        noise = rng.normal(size=(64, 200, 2)) @ np.array([1.0, 1.0j])
        assert not parallel_ramps(noise).any()


def test_few_ramps_say_nothing() -> None:
    frame = np.zeros((7, 64), dtype=complex)
    frame[3] = 1.0
    assert not parallel_ramps(frame).any()
