"""Interferers that send other things than equal chirps: simulated, separated, recognised."""

from functools import cache

import numpy as np
import pytest

from tests.vsep.waveform_bench import missed_and_false
from vsep.errors import InputError
from vsep.inference.bursts.noise_like import loud_samples, noise_like_ramps
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.waveforms import NOISE_LIKE, recognised_waveforms
from vsep.parameters import WAVEFORMS
from vsep.presets.scenes import simulate_preset
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.signal.transmitters import HOP, NO_CHIRPS


@cache
def drawn(waveform, preset="hopping-chirps", seed=3):
    return simulate_preset(
        preset, snr_db=40.0, sir_db=-20.0, seed=seed, interferer_waveform=waveform
    )


@cache
def separated(waveform, preset="hopping-chirps"):
    scenario, observation = drawn(waveform, preset)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    return run(FactorisedSeparator(model=model), observation.received).state


def crossings(waveform):
    """Ramps and crossings in ramps of the true bursts, and slopes relative to the victim's."""
    scenario, observation = drawn(waveform)
    bursts = observation.truth.bursts
    ramp_s = scenario.radar.num_samples / scenario.radar.sample_rate_hz
    slopes = np.array([burst.slope_hz_per_s for burst in bursts])
    starts = np.array([burst.start_frequency_hz for burst in bursts])
    return np.array([burst.ramp for burst in bursts]), -starts / slopes / ramp_s, slopes


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_the_truth_says_what_was_sent_and_where(waveform):
    truth = drawn(waveform)[1].truth
    assert truth.waveforms == (waveform,)
    power = np.abs(truth.interference_signal) ** 2
    assert power.sum() == pytest.approx(100.0 * np.sum(np.abs(truth.object_signal) ** 2))
    mask = truth.perfect_mask()
    assert 0.01 < mask.mean() < 0.9
    assert power[mask].sum() > 0.99 * power.sum()
    assert bool(truth.bursts) == (waveform not in NO_CHIRPS)


def test_starts_that_hop_move_the_crossing_within_the_ramp():
    (ramps, centres, slopes), (_, usual, own) = crossings("hopping-chirps"), crossings("chirps")
    assert ramps.tolist() == list(range(32))
    np.testing.assert_allclose(slopes, own)
    moved = centres - usual
    assert np.abs(moved).max() <= HOP
    # The standard deviation of a uniform law over 0.8 is 0.23; of 32 draws it is within a third.
    assert np.std(moved) == pytest.approx(2.0 * HOP / np.sqrt(12.0), rel=0.33)


def test_up_and_down_chirps_and_two_profiles_take_turns():
    usual = crossings("chirps")[2][0]
    ramps, centres, slopes = crossings("two-profiles")
    assert ramps.tolist() == list(range(32))
    np.testing.assert_allclose(slopes, np.where(ramps % 2, 2.0 * usual, usual))
    # 10 ns a ramp, times 8.25 MHz/us over 1.75 MHz/us: 1.5 us of 25.6 us in the frame
    np.testing.assert_allclose(centres, 0.5, atol=0.065)
    slopes = crossings("up-and-down-chirps")[2]
    # 8.25 MHz/us of the interferer, 10 MHz/us of the victim
    np.testing.assert_allclose(slopes, np.where(ramps % 2, -18.25e12, -1.75e12))


def test_what_is_no_chirp_is_on_while_the_victim_sweeps_through_its_band():
    _, observation = drawn("ofdm")
    power = np.mean(np.abs(observation.truth.interference_signal) ** 2, axis=0)
    inside = power > 0.1 * power.max()
    # A quarter of the ramp, with the pass band of 5 MHz at 10 MHz/us at both ends
    assert np.count_nonzero(inside) / 256 == pytest.approx(0.25, abs=0.06)
    assert np.flatnonzero(inside).mean() == pytest.approx(128.0, abs=12.0)


def test_other_seeds_send_other_codes_and_one_the_same():
    first, other = (drawn("phase-coded", seed=s)[1].truth.interference_signal for s in (3, 4))
    overlap = abs(np.vdot(first, other)) / (np.linalg.norm(first) * np.linalg.norm(other))
    assert overlap < 0.2
    again = simulate_preset(
        "hopping-chirps", snr_db=40.0, sir_db=-20.0, seed=3, interferer_waveform="phase-coded"
    )[1]
    np.testing.assert_array_equal(again.truth.interference_signal, first)


def test_an_unknown_waveform_is_refused():
    with pytest.raises(InputError, match="waveform is 'noise'; it must be one of chirps"):
        simulate_preset("simulation-1", snr_db=1, sir_db=1, seed=0, interferer_waveform="noise")


@pytest.mark.parametrize(
    "waveform", ["chirps", "hopping-chirps", "up-and-down-chirps", "two-profiles"]
)
def test_chirps_are_recognised(waveform):
    (found,) = recognised_waveforms(separated(waveform), drawn(waveform)[0].radar)
    assert (found.waveform, found.num_bursts) == (waveform, 32)
    assert found.share > 0.7


@pytest.mark.slow
def test_four_radars_are_recognised_as_such():
    found = recognised_waveforms(separated("chirps", "many-bursts"), drawn("chirps")[0].radar)
    assert [each.waveform for each in found] == ["chirps"] * 4


@pytest.mark.parametrize("waveform", NO_CHIRPS)
def test_what_is_no_chirp_is_noise_of_known_support_and_named(waveform):
    scenario, observation = drawn(waveform)
    state = separated(waveform)
    assert len(state.bursts) == 0
    # All of it that is clearly louder than the noise is set aside, and little else.
    mask = observation.truth.perfect_mask(10.0)
    assert np.mean(state.noise_like[mask]) > 0.98
    assert state.noise_like.mean() < observation.truth.perfect_mask().mean() + 0.1
    (found,) = recognised_waveforms(state, scenario.radar, observation.received)
    assert (found.waveform, found.num_bursts) == (waveform, 32)
    # Without the frame there is nothing that tells which it is.
    assert recognised_waveforms(state, scenario.radar)[0].waveform == NOISE_LIKE


@pytest.mark.parametrize("waveform", ["stepped", "ofdm"])
def test_beside_a_noise_like_waveform_the_objects_are_found_and_no_others(waveform):
    observation = drawn(waveform)[1]
    missed, false = missed_and_false(separated(waveform).objects, observation.truth, (32, 256))
    assert missed == 0
    assert false <= 1


def test_a_run_does_not_end_before_loud_samples_are_weighed():
    scenario, observation = simulate_preset(
        "phase-coded", snr_db=60.0, sir_db=-20.0, seed=505, interferer_waveform="stepped"
    )
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    found = run(FactorisedSeparator(model=model), observation.received).objects
    assert missed_and_false(found, observation.truth, model.shape)[0] <= 1


def test_without_interference_nothing_is_recognised():
    scenario, observation = drawn("ofdm")
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    clean = observation.received - observation.truth.interference_signal
    assert (
        recognised_waveforms(run(FactorisedSeparator(model=model), clean).state, scenario.radar)
        == ()
    )


def test_four_radars_in_every_ramp_are_chirps():
    scenario, observation = simulate_preset("many-bursts", snr_db=40.0, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    rows = observation.received[None]
    found = loud_samples(rows)
    # Even if the first chirp of each ramp explained nothing
    assert len(noise_like_ramps(rows, np.zeros_like(rows), found, model)) == 0


def test_noise_in_a_part_of_some_ramps_is_noise_like_and_in_two_ramps_is_not():
    rng = np.random.default_rng(5)
    model = SignalModel(
        num_ramps=8,
        num_samples=128,
        sample_rate_hz=1e7,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e6, rolloff=0.25),
    )
    parts = rng.standard_normal((2, 8, 128))
    rows = parts[0] + 1j * parts[1]
    rows[2:6, 40:90] *= 30.0
    found = loud_samples(rows[None])
    nothing = np.zeros_like(rows[None])
    assert noise_like_ramps(rows[None], nothing, found, model).tolist() == [2, 3, 4, 5]
    rows[2:4] /= 30.0
    found = loud_samples(rows[None])
    assert len(noise_like_ramps(rows[None], nothing, found, model)) == 0
