"""Dithered ramps: atoms, bound, map, estimates at the bound, files and settings."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.analysis.crlb import dispersion_bound
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.inference.core.run import run
from vsep.inference.deviations import state_deviations
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.dithered import candidate_power
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.inference.waveforms import recognised_waveforms
from vsep.presets.scenes import simulate_preset
from vsep.signal.atoms import dense_atoms
from vsep.signal.dithered_atoms import (
    RampDither,
    coupled_jets,
    coupled_products,
    coupled_signals,
    signal_jet,
)
from vsep.signal.dithering import parse_starts
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import simulate
from vsep.signal.spectra import range_doppler_map
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency

SHAPE = 8, 32
POINTS = np.array([[0.10, 0.20], [0.13, 0.25], [-0.30, -0.10]])


def dither(lowest_beat=-0.5):
    rng = np.random.default_rng(4)
    return RampDither(
        start_ramps=tuple(rng.uniform(-0.3, 0.3, SHAPE[0])),
        start_samples=tuple(rng.uniform(-5.0, 5.0, SHAPE[0])),
        lowest_beat=lowest_beat,
    )


def drawn(seed=11, sir_db=-20.0, **changes):
    scenario, observation = simulate_preset(
        "dithered-ramps", snr_db=50.0, sir_db=sir_db, seed=seed, **changes
    )
    return (
        scenario,
        observation,
        SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter),
    )


def test_a_frame_is_what_the_radar_equation_gives_at_the_true_starts():
    scenario, _, _ = drawn()
    radar = scenario.radar
    delay, velocity = 1.2e-7, 8.0
    doppler_hz = 2.0 * velocity / SPEED_OF_LIGHT_MPS * radar.start_frequency_hz
    channel = Channel(
        delays_s=np.array([delay]), dopplers_hz=np.array([doppler_hz]), weights=np.ones(1)
    )
    observation = simulate(
        radar,
        Scene(objects=channel, snr_db=200.0),
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        rng=np.random.default_rng(0),
    )
    # Phase of the mixed signal: (f_0 + epsilon_p + k t') tau, and nu at the time the ramp starts
    times = np.arange(radar.num_ramps) * radar.ramp_period_s + np.array(radar.start_times_s)
    offsets_hz = np.array(radar.start_frequencies_hz)[:, None]
    cycles = (offsets_hz + radar.slope_hz_per_s * radar.sample_times_s) * delay
    expected = np.exp(-2j * np.pi * (cycles + doppler_hz * times[:, None])) / np.sqrt(32 * 256)
    np.testing.assert_allclose(observation.truth.object_signal, expected, atol=1e-12)


@pytest.mark.parametrize("lowest_beat", [-0.5, 0.0])
def test_products_and_signals_are_those_of_the_atoms_in_full(lowest_beat):
    ramps = dither(lowest_beat)
    atoms = dense_atoms(POINTS[:, 0], POINTS[:, 1], SHAPE, ramps)
    gram = np.einsum("apn,bpn->ab", atoms.conj(), atoms)
    np.testing.assert_allclose(coupled_jets(POINTS, ramps, *SHAPE, 1)[0], gram, atol=1e-12)
    np.testing.assert_allclose(coupled_jets(POINTS, ramps, *SHAPE, 6)[0], gram, atol=1e-12)
    rng = np.random.default_rng(5)
    weights = rng.standard_normal((3, 2)) + 1j * rng.standard_normal((3, 2))
    signals = np.einsum("ka,kpn->apn", weights, atoms)
    made = coupled_signals(POINTS, weights, ramps, *SHAPE)
    np.testing.assert_allclose(made.reshape(2, *SHAPE), signals, atol=1e-12)
    np.testing.assert_allclose(
        coupled_products(POINTS, ramps, SHAPE[0], made), gram @ weights, atol=1e-12
    )


def test_derivatives_of_what_an_atom_explains_are_those_of_differences():
    ramps, signals = dither(), dense_atoms(*POINTS.T, SHAPE, dither())[:2]
    place, step = np.array([0.105, 0.21]), 1e-5

    def power(by_beat, by_doppler):
        moved = place + step * np.array([by_beat, by_doppler])
        return float(np.sum(np.abs(signal_jet(moved, signals, ramps)[0]) ** 2))

    jet = signal_jet(place, signals, ramps)
    value, first, bd = jet[0], jet[1:3], jet[4]
    slopes = [2.0 * np.vdot(value, each).real for each in first]
    expected = [(power(1, 0) - power(-1, 0)), (power(0, 1) - power(0, -1))]
    np.testing.assert_allclose(slopes, np.array(expected) / (2.0 * step), rtol=1e-5)
    bend = 2.0 * (np.vdot(first[0], first[1]) + np.vdot(value, bd)).real
    corners = power(1, 1) - power(1, -1) - power(-1, 1) + power(-1, -1)
    assert bend == pytest.approx(corners / (4.0 * step**2), rel=1e-3)


def test_candidates_and_the_map_peak_where_the_object_is():
    ramps = dither()
    atom = dense_atoms(np.array([0.25]), np.array([-0.125]), SHAPE, ramps)
    power = candidate_power(atom, ramps)
    row, column = np.unravel_index(power.argmax(), power.shape)
    assert ((row - 8) / 16, column / 64) == (-0.125, 0.25)
    assert power.max() == pytest.approx(1.0, abs=1e-5)
    found = range_doppler_map(atom[0], window="rectangular", migration=ramps)
    row, column = np.unravel_index(found.power.argmax(), found.power.shape)
    assert (found.dopplers[row], found.beats[column]) == (-0.125, 0.25)
    assert found.power.max() == pytest.approx(1.0, abs=1e-9)
    plain = range_doppler_map(atom[0], window="rectangular")
    assert plain.power.max() < 0.7


def test_equal_ramps_are_a_dither_of_nothing():
    nothing = RampDither(start_ramps=(0.0,) * 8, start_samples=(0.0,) * 8)
    atoms = dense_atoms(*POINTS.T, SHAPE, nothing)
    np.testing.assert_allclose(atoms, dense_atoms(*POINTS.T, SHAPE), atol=1e-12)
    scenario, _, _ = drawn()
    equal = replace(scenario.radar, start_times_s=(0.0,) * 32, start_frequencies_hz=())
    assert equal.migration.coupling == 0.0


def test_objects_of_dithered_ramps_are_at_the_bound_and_deviations_cover_them():
    errors, covered = [], []
    for seed in range(3):
        _, observation, model = drawn(seed=200 + seed, interference=False)
        state = run(ObjectOnlySeparator(model=model), observation.received).state
        truth, objects = observation.truth, state.objects
        assert objects.num_components == len(truth.beats)
        bound = dispersion_bound(truth, model)
        std = state_deviations(state, model.shape, model.migration)
        for index, (beat, doppler) in enumerate(zip(truth.beats, truth.dopplers, strict=True)):
            moves = wrap_frequency(objects.beats - beat), objects.dopplers - doppler
            near = int(np.argmin(np.hypot(256 * moves[0], 32 * moves[1])))
            errors.append(
                (moves[0][near] / bound.beats[index], moves[1][near] / bound.dopplers[index])
            )
            covered += [
                abs(moves[0][near]) < std.beats[near],
                abs(moves[1][near]) < std.dopplers[near],
            ]
    # 36 objects: the root mean square of standard normal numbers is 1 +- 0.12 (one sigma), and
    # 68 % +- 5.5 % of 72 lie within a deviation.
    np.testing.assert_allclose(np.sqrt(np.mean(np.square(errors), axis=0)), 1.0, atol=0.36)
    assert 0.683 - 0.165 < np.mean(covered) < 0.683 + 0.165


def test_beside_an_interferer_all_are_found_and_its_chirps_are_equal():
    scenario, observation, model = drawn()
    state = run(FactorisedSeparator(model=model), observation.received).state
    assert state.objects.num_components == 12
    (found,) = recognised_waveforms(state, scenario.radar)
    assert found.waveform == "chirps"
    # Of equal ramps it crosses all; some of these start too high.
    assert 20 < len(observation.truth.bursts) - 1 <= found.num_bursts < 32


def test_a_file_keeps_the_starts_of_its_ramps(tmp_path):
    scenario, observation, _ = drawn()
    path = str(tmp_path / "frame.npz")
    frame = Frame(received=observation.received, radar=scenario.radar, name=path)
    write_frame(path, frame)
    assert read_frame(path).radar == scenario.radar


def test_starts_are_listed_or_drawn_as_numpy_draws_them():
    expected = np.random.default_rng(7).uniform(-2e-6, 2e-6, 5)
    assert parse_starts("start_times_s", "uniform 2e-6 7", 5) == tuple(expected)
    assert parse_starts("start_times_s", "1, -2.5, 3e-6", 3) == (1.0, -2.5, 3e-6)
    for text in ("uniform", "uniform 1e-6", "1;2", ""):
        with pytest.raises(InputError, match="a number for each ramp"):
            parse_starts("start_times_s", text, 3)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"start_times_s": (0.0, 1e-6)}, "holds 2 values; it must hold one for each of the 32"),
        ({"start_times_s": (1.0,) * 32}, "start_times_s is 1 s"),
    ],
)
def test_starts_that_do_not_fit_are_refused(changes, sentence):
    radar = drawn()[0].radar
    with pytest.raises(InputError, match=sentence):
        replace(radar, **changes)
