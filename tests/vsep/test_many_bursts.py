"""Many bursts in a ramp, and bursts that last for several ramps."""

import numpy as np
import pytest

from tests.vsep import burst_bench
from tests.vsep import impaired_bench as bench
from vsep.inference.bursts.chirp_search import find_single_chirps
from vsep.inference.bursts.long_chirps import lone_tones, with_long_chirps
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel
from vsep.studies.catalogue import make_study
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.trial import run_trial
from vsep.units import wrap_frequency

NO_BURSTS = bench.Bursts(share_of_ramps=0.0)
FOUR_RAMPS_LONG_HZ_PER_S = 1e13 - 0.025e12


def separated(received):
    return run(FactorisedSeparator(model=bench.MODEL), received)


def test_four_bursts_in_every_ramp_are_found_and_hide_few_objects():
    points, received = bench.scene(bench.MANY["four in every ramp"], [17, 3])
    solution = separated(received)
    assert solution.termination is Termination.CONVERGED
    found = np.bincount([burst.ramp for burst in solution.state.bursts], minlength=32)
    # Where two cross band and ramp at the same time and slope, they are one.
    assert np.mean(found >= 4) > 0.7
    assert solution.state.used_share > 0.7
    without = bench.missed(separated(bench.scene(NO_BURSTS, [17, 3])[1]).objects, points)
    assert bench.missed(solution.objects, points) <= without + 5


@pytest.mark.parametrize(
    ("point", "realization"), [(51, 22), (51, 14), (41, 56), (24, 74), (16, 3)]
)
def test_objects_within_a_cell_are_resolved_beside_strong_bursts(point, realization):
    # Ten objects, some within a cell, with one to three bursts in a quarter or half of the ramps.
    # Lines that are not found yet look like coloured noise beside bursts that are not.
    (row,) = run_trial(make_study("fig-5", methods=("factorised",)).trial(point, realization))
    (clean,) = run_trial(make_study("fig-5", methods=(NO_INTERFERENCE,)).trial(point, realization))
    assert row["termination"] == "converged"
    assert row["false_alarms"] <= clean["false_alarms"] + 1
    assert row["misses"] <= clean["misses"] + 1


def test_a_tone_in_one_ramp_stands_out_and_one_in_all_ramps_does_not():
    samples = np.arange(64)
    rows = np.exp(0.9j * samples) * np.ones((8, 1))
    assert not lone_tones(rows).any()
    rows[5] += 5.0 * np.exp(2.1j * samples)
    assert np.flatnonzero(lone_tones(rows)).tolist() == [5]
    # Of three ramps none is usual.
    assert not lone_tones(rows[4:7]).any()


def test_a_chirp_of_four_ramps_is_found_though_a_tone_comes_close():
    samples = np.arange(burst_bench.NUM_SAMPLES)
    width = 2.0 * burst_bench.MODEL.normalised_cutoff
    slope, start = -width / (4.0 * burst_bench.NUM_SAMPLES), 0.11
    rows = 3.0 * np.exp(2j * np.pi * (start * samples + 0.5 * slope * samples**2))[None]
    rows = rows + burst_bench.noise(1, 0.3)
    found = find_single_chirps(rows, burst_bench.MODEL, least_score=0.0)
    better = with_long_chirps(found, rows, np.array([True]), burst_bench.MODEL)
    assert better.score[0] > 0.9 * np.sum(np.abs(rows) ** 2)
    assert better.slope[0] == pytest.approx(slope, abs=0.5 / burst_bench.NUM_SAMPLES**2)
    assert better.start_frequency[0] == pytest.approx(start, abs=1.0 / burst_bench.NUM_SAMPLES)
    same = with_long_chirps(found, rows, np.array([False]), burst_bench.MODEL)
    np.testing.assert_array_equal(same.slope, found.slope)


def test_a_tone_is_no_long_chirp():
    rows = np.exp(0.7j * np.arange(burst_bench.NUM_SAMPLES))[None]
    found = find_single_chirps(rows, burst_bench.MODEL, least_score=0.0)
    same = with_long_chirps(found, rows, np.array([True]), burst_bench.MODEL)
    np.testing.assert_array_equal(same.slope, found.slope)


def test_bursts_four_ramps_long_hide_no_object():
    scenario, observation = simulate_preset(
        "simulation-2-a",
        snr_db=60.0,
        sir_db=-20.0,
        seed=1009,
        interferer_slope_hz_per_s=FOUR_RAMPS_LONG_HZ_PER_S,
    )
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    found = run(FactorisedSeparator(model=model), observation.received).objects
    assert found.num_components == 10
    for beat, doppler in zip(observation.truth.beats, observation.truth.dopplers, strict=True):
        cells = np.abs(wrap_frequency(found.beats - beat)) * 128
        cells = np.maximum(cells, np.abs(wrap_frequency(found.dopplers - doppler)) * 16)
        assert cells.min() < 1.0


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("four in every ramp", 3.0),
        pytest.param("four in half of the ramps", 1.5, marks=pytest.mark.slow),
    ],
)
def test_many_bursts_cost_few_weak_objects(name, more):
    cost, converged, frames = [], 0, 6
    for seed in range(frames):
        points, received = bench.scene(bench.MANY[name], [18, seed])
        solution = separated(received)
        # The same objects and the same noise
        clean = separated(bench.scene(NO_BURSTS, [18, seed])[1])
        cost.append(bench.missed(solution.objects, points) - bench.missed(clean.objects, points))
        converged += solution.termination is Termination.CONVERGED
    assert np.mean(cost) <= more
    assert converged >= 0.9 * frames
