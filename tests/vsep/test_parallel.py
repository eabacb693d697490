"""`vsep.analysis.parallel`: an interferer of the same slope, and what is none."""

from dataclasses import replace

import numpy as np
import pytest

from tests.vsep import impaired_bench as bench
from vsep.analysis.parallel import parallel_ramps
from vsep.files.frame import Frame
from vsep.files.frame_mask import set_aside_same_slope
from vsep.inference.core.run import run
from vsep.inference.registry import make_estimator
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


def test_no_weak_burst_is_taken_for_it() -> None:
    # Bursts of -10 to 40 dB below which some bins are sudden and others are not.
    draws = np.random.default_rng(77)
    for name in ("simulation-2-a", "simulation-2-c", "measurement", "moving-car"):
        for _ in range(12):
            _, observation = simulate_preset(
                name,
                snr_db=draws.uniform(20.0, 70.0),
                sir_db=draws.uniform(-40.0, 10.0),
                second_interferer=bool(draws.uniform() < 0.3),
                seed=int(draws.integers(1 << 30)),
            )
            assert not parallel_ramps(observation.received).any()


def test_objects_of_the_other_ramps_come_out_where_those_with_it_are_set_aside() -> None:
    frames = range(6)
    missed_by, ghosts_by = np.zeros(2, dtype=int), np.zeros(2, dtype=int)
    for seed in frames:
        points, frame, ramps = _frame_with_same_slope(seed)
        taken = set_aside_same_slope(frame)
        assert taken.missing is not None
        assert np.array_equal(np.flatnonzero(taken.missing[0].all(axis=1)), ramps)
        for index, each in enumerate((frame, taken)):
            estimator = make_estimator(
                "factorised", bench.MODEL, missing=each.missing_rows(together=False)
            )
            objects = run(estimator, each.received).state.objects
            missed_by[index] += bench.missed(objects, points)
            ghosts_by[index] += bench.ghosts(objects, points)
    assert missed_by[1] == ghosts_by[1] == 0
    assert missed_by[0] > len(frames)


def test_a_tone_at_one_antenna_sets_a_ramp_of_all_of_them_aside() -> None:
    _, frame, ramps = _frame_with_same_slope(1)
    rng = np.random.default_rng(3)
    noise = rng.normal(size=(*bench.SHAPE, 2)) @ np.array([1.0, 1.0j])
    several = replace(frame, antennas=np.stack([noise, frame.received]), antenna=1)
    taken = set_aside_same_slope(several).missing
    assert taken is not None
    assert np.array_equal(np.flatnonzero(taken[0].all(axis=1)), ramps)
    assert np.array_equal(taken[0], taken[1])


def _frame_with_same_slope(seed: int) -> tuple[np.ndarray, Frame, np.ndarray]:
    """Ten objects of 20 to 40 dB, and in every sixth ramp a tone of 40 to 60 dB."""
    rng = np.random.default_rng(seed)
    points = bench.separated_points(rng)[:10]
    received = rng.normal(size=(*bench.SHAPE, 2), scale=np.sqrt(0.5)) @ np.array([1.0, 1.0j])
    ramp, sample = np.ogrid[: bench.SHAPE[0], : bench.SHAPE[1]]
    for beat, doppler in points:
        level = 10.0 ** (rng.uniform(20.0, 40.0) / 10.0) / received.size
        phase = rng.uniform() + beat * sample + doppler * ramp
        received += np.sqrt(level) * np.exp(-2j * np.pi * phase)
    ramps = np.arange(rng.integers(0, 6), bench.SHAPE[0], 6)
    level = 10.0 ** (rng.uniform(40.0, 60.0) / 10.0) / bench.SHAPE[1]
    for number, each in enumerate(ramps):
        phase = rng.uniform() + (0.05 + 0.013 * number) * sample[0]
        received[each] += np.sqrt(level) * np.exp(2j * np.pi * phase)
    radar = replace(RADAR, num_samples=bench.SHAPE[1], num_ramps=bench.SHAPE[0])
    return points, Frame(received=received, radar=radar), ramps


def test_few_ramps_say_nothing() -> None:
    frame = np.zeros((7, 64), dtype=complex)
    frame[3] = 1.0
    assert not parallel_ramps(frame).any()
