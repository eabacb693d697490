"""Objects that move through range cells, from the simulator to deviations and files."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import sici

from vsep.analysis.crlb import dispersion_bound, shared_dispersion_bound
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.files.results import result_line
from vsep.inference.core.run import run
from vsep.inference.objects.uncertainty import dispersion_std, fisher_information
from vsep.inference.registry import make_estimator
from vsep.kernels.moving_atoms import STATIONARY
from vsep.recordings.convert import convert_recording
from vsep.recordings.migration import visible_walker
from vsep.recordings.settings import RecordingSettings
from vsep.signal.filters import NoFilter
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import simulate, simulate_antennas
from vsep.signal.spectra import range_doppler_map
from vsep.signal.template import SignalModel

CARRIER_HZ = 77e9
RADAR = ChirpSequence(  # 767 MHz in a ramp, 128 ramps of 60 us
    start_frequency_hz=CARRIER_HZ,
    slope_hz_per_s=29.96e12,
    sample_rate_hz=10e6,
    ramp_period_s=60e-6,
    num_samples=256,
    num_ramps=128,
    range_migration=True,
)
SMALL = replace(RADAR, num_ramps=32, num_samples=64, slope_hz_per_s=120e12)


def channel(ranges_m, velocities_mps, levels_db=0.0):
    ranges_m, velocities_mps = np.atleast_1d(ranges_m), np.atleast_1d(velocities_mps)
    return Channel(
        delays_s=2.0 * ranges_m / SPEED_OF_LIGHT_MPS,
        dopplers_hz=2.0 * velocities_mps / SPEED_OF_LIGHT_MPS * CARRIER_HZ,
        weights=10.0 ** (levels_db / 20.0) * np.exp(1j * np.arange(len(ranges_m))),
    )


def frame_of(radar, objects, snr_db, seed=1):
    rng, scene = np.random.default_rng(seed), Scene(objects=objects, snr_db=snr_db)
    return simulate(radar, scene, anti_aliasing_filter=NoFilter(), rng=rng)


def model_of(radar, num_antennas=1):
    return SignalModel.of_radar(radar, NoFilter(), num_antennas)


def separated(name, radar, received, **settings):
    return run(make_estimator(name, model_of(radar), **settings), received)


def five_objects(cells, radar, seed):
    """Five objects, walking so many range cells in a frame, apart from each other."""
    rng = np.random.default_rng(seed)
    speed = cells * radar.one_cell_mps * rng.choice([-1.0, 1.0], 5)
    return channel(5.0 + 5.0 * np.arange(5) + rng.uniform(0.0, 2.0, 5), speed)


def test_nothing_is_coupled_where_nothing_walks():
    assert RADAR.migration.coupling == pytest.approx(29.96e12 / 10e6 / 77e9, rel=1e-12)
    assert RADAR.migration.ramp_share == pytest.approx(0.1 / 60.0, rel=1e-12)
    # 70 m/s are 2.16 cycles a ramp: two intervals to either side
    assert RADAR.migration.folds == 2
    for other in (
        replace(RADAR, range_migration=False),
        replace(RADAR, num_ramps=1),
        # 70 m/s times 7.68 ms over a cell of 293 m
        replace(RADAR, slope_hz_per_s=2e10),
    ):
        assert other.migration == STATIONARY
        assert model_of(other).is_stationary


@pytest.mark.parametrize("velocity_mps", [5.0, 15.0, 30.0])
def test_a_car_is_one_object_where_it_is_at_mid_frame(velocity_mps):
    observation = frame_of(RADAR, channel(20.0, velocity_mps), 62.0)
    solution = separated("object-only", RADAR, observation.received)
    (beat,), (doppler,) = solution.objects.beats, solution.objects.dopplers
    assert RADAR.range_from_beat(np.array([beat]))[0] == pytest.approx(20.0, abs=0.02)
    velocity = RADAR.velocity_from_doppler(np.array([doppler]))[0]
    assert velocity == pytest.approx(velocity_mps, abs=0.02)
    state = solution.state
    assert state.effective_precision == pytest.approx(observation.truth.noise_precision, rel=0.03)
    still = separated("object-only", replace(RADAR, range_migration=False), observation.received)
    assert still.objects.num_components > 3


@pytest.mark.parametrize("name", ["factorised", "masked"])
@pytest.mark.parametrize("cells", [0.3, 1.0])
def test_objects_that_walk_are_as_many_as_there_are(name, cells):
    observation = frame_of(SMALL, five_objects(cells, SMALL, 3), 57.0)
    mask = np.zeros(SMALL.shape, np.bool_)
    mask[:, 20:26] = True
    settings = {"mask": mask} if name == "masked" else {}
    solution = separated(name, SMALL, observation.received, **settings)
    assert solution.objects.num_components == 5
    model, state, truth = model_of(SMALL), solution.state, observation.truth
    order = [int(np.argmin(abs(solution.objects.beats - beat))) for beat in truth.beats]
    std = dispersion_std(
        solution.objects, state.effective_precision, model.shape, None, model.migration
    )
    bound = dispersion_bound(truth, model)
    lost = 64.0 / 58.0 if name == "masked" else 1.0
    # lambda is known to a few per cent; a mask loses samples.
    np.testing.assert_allclose(std.beats[order] / bound.beats, lost**0.5, rtol=0.1)
    np.testing.assert_allclose(std.dopplers[order] / bound.dopplers, lost**0.5, rtol=0.1)
    assert np.all(abs(solution.objects.beats[order] - truth.beats) < 5.0 * bound.beats * lost)
    errors = solution.objects.dopplers[order] - truth.dopplers
    assert np.all(abs(errors) < 5.0 * bound.dopplers * lost)


def test_antennas_share_what_walks():
    antennas = UniformLinearArray(num_antennas=3)
    scene = AntennaScene(
        scene=Scene(objects=channel([4.0, 9.0], [30.0, -8.0]), snr_db=35.0),
        antennas=antennas,
        object_angles_deg=np.array([20.0, -30.0]),
        interferer_angles_deg=np.zeros(0),
    )
    rng = np.random.default_rng(4)
    observation = simulate_antennas(SMALL, scene, anti_aliasing_filter=NoFilter(), rng=rng)
    model = model_of(SMALL, 3)
    solution = run(make_estimator("factorised", model), observation.received)
    truth, objects = observation.truth, solution.objects
    assert objects.num_components == 2
    order = np.argsort(objects.beats)[np.argsort(np.argsort(truth.beats))]
    bound = shared_dispersion_bound(truth, model)
    assert np.all(abs(objects.beats[order] - truth.beats) < 5.0 * bound.beats)
    assert np.all(abs(objects.dopplers[order] - truth.dopplers) < 5.0 * bound.dopplers)
    std = dispersion_std(
        objects, solution.state.effective_precision, SMALL.shape, None, model.migration
    )
    np.testing.assert_allclose(std.dopplers[order], bound.dopplers, rtol=0.1)


def test_the_bound_is_that_of_dense_derivatives():
    # Two objects half a cell apart: the bound by QR of full derivatives, and by inner products
    truth = frame_of(SMALL, channel([4.0, 4.1], [20.0, 24.0]), 40.0).truth
    model = model_of(SMALL)
    bound = dispersion_bound(truth, model)
    fisher = fisher_information(
        truth.beats,
        truth.dopplers,
        truth.amplitudes,
        np.full(2, 1e-9),
        truth.noise_precision,
        model.shape,
        model.migration,
    )
    expected = np.sqrt(np.diagonal(np.linalg.inv(fisher)))
    np.testing.assert_allclose(np.concatenate([bound.beats, bound.dopplers]), expected, rtol=1e-5)


def test_neglected_is_a_model_without_migration():
    received = frame_of(SMALL, channel([4.0, 9.0], [2.0, -1.0]), 30.0).received
    neglected = separated("object-only", SMALL, received, range_migration="neglected")
    without = separated("object-only", replace(SMALL, range_migration=False), received)
    np.testing.assert_array_equal(neglected.objects.beats, without.objects.beats)
    np.testing.assert_array_equal(neglected.state.object_signal, without.state.object_signal)


def test_who_cannot_says_so():
    with pytest.raises(InputError, match="joint estimator does not model range migration"):
        make_estimator("joint", model_of(SMALL))
    assert make_estimator("joint", model_of(SMALL), range_migration="neglected").model.is_stationary
    with pytest.raises(InputError, match="range_migration is 'off'"):
        make_estimator("factorised", model_of(SMALL), range_migration="off")


def test_a_map_along_the_velocity_has_one_peak():
    truth = frame_of(RADAR, channel(20.0, 30.0), 60.0).truth
    signal, doppler = truth.object_signal, truth.dopplers[0]
    energy = np.abs(truth.amplitudes[0]) ** 2
    shown = range_doppler_map(signal, 8, "rectangular", migration=RADAR.migration, doppler=doppler)
    # Half a point of the grid off in both: sinc(1/16)^4
    assert shown.power.max() > 0.97 * energy
    row, column = np.unravel_index(np.argmax(shown.power), shown.power.shape)
    assert shown.beats[column] == pytest.approx(truth.beats[0], abs=0.5 / (8 * 256))
    assert shown.dopplers[row] == pytest.approx((doppler + 0.5) % 1.0 - 0.5, abs=0.5 / (8 * 128))
    # Every row along its own velocity: 30 m/s are beyond the first interval, -2.4 m/s are not.
    slow = frame_of(RADAR, channel(20.0, -2.4), 60.0).truth
    every = range_doppler_map(slow.object_signal, 8, "rectangular", migration=RADAR.migration)
    assert every.power.max() > 0.97 * energy
    row, column = np.unravel_index(np.argmax(every.power), every.power.shape)
    assert every.beats[column] == pytest.approx(slow.beats[0], abs=0.5 / (8 * 256))
    assert every.dopplers[row] == pytest.approx(slow.dopplers[0], abs=0.5 / (8 * 128))
    # The mean of exp(j 2 pi m x y) over a cell in both, for m cells
    turns = np.pi * 30.0 / RADAR.one_cell_mps
    kept = (2.0 * sici(0.5 * turns)[0] / turns) ** 2
    uncompensated = range_doppler_map(signal, 8, "rectangular").power.max()
    assert uncompensated == pytest.approx(kept * energy, rel=0.02)


def test_a_frame_file_keeps_the_flag(tmp_path):
    observation = frame_of(SMALL, channel([4.0], [30.0]), 30.0)
    for radar in (SMALL, replace(SMALL, range_migration=False)):
        frame = Frame(received=observation.received, radar=radar, truth=observation.truth)
        write_frame(tmp_path / "frame.npz", frame)
        assert read_frame(tmp_path / "frame.npz").radar == radar


@pytest.mark.slow
@pytest.mark.parametrize("velocity_mps", [5.0, 15.0, 30.0])
def test_errors_of_a_car_are_those_of_the_bound(velocity_mps):
    errors, false_alarms = [], 0
    model = model_of(RADAR)
    for seed in range(200):
        observation = frame_of(RADAR, channel(20.0, velocity_mps), 62.0, seed)
        objects = separated("object-only", RADAR, observation.received).objects
        false_alarms += objects.num_components - 1
        car, truth = int(np.argmax(abs(objects.amplitudes))), observation.truth
        bound = dispersion_bound(truth, model)
        errors.append(
            [
                (objects.beats[car] - truth.beats[0]) / bound.beats[0],
                (objects.dopplers[car] - truth.dopplers[0]) / bound.dopplers[0],
            ]
        )
    # 0.05 a frame are asked: 10 give or take 3. The root mean square of 200 is known to 5 %.
    assert false_alarms < 20
    assert np.all(np.sqrt(np.mean(np.square(errors), axis=0)) < 1.1)


@pytest.mark.slow
@pytest.mark.parametrize("cells", [0.3, 1.0])
def test_five_that_walk_are_five_in_ten_frames(cells):
    counts = []
    for seed in range(10):
        # Each 50 dB, all together 7 dB more
        observation = frame_of(RADAR, five_objects(cells, RADAR, seed), 57.0, seed)
        counts.append(separated("factorised", RADAR, observation.received).objects.num_components)
    assert min(counts) == 5
    assert sum(counts) <= 51


def recorded(path, velocity_mps, angle_deg=0.0, num_transmitters=1):
    """Write an array (ramps, antennas, samples) of exact delays; return its settings."""
    ramps, antennas = 64 * num_transmitters, 3
    samples_s = 6e-6 + np.arange(64) / 5e6
    times_s = 60e-6 * np.arange(ramps)[:, None] + samples_s
    delays_s = 2.0 * (8.0 + velocity_mps * (times_s - times_s.mean())) / SPEED_OF_LIGHT_MPS
    turns = (CARRIER_HZ + 60e12 * samples_s) * delays_s  # exp(j 2 pi f tau), as sensors store it
    places = np.arange(antennas) + antennas * (np.arange(ramps) % num_transmitters)[:, None]
    steering = -0.5 * places * np.sin(np.radians(angle_deg))
    signal = 30.0 * np.exp(2j * np.pi * (turns[:, None] + steering[:, :, None]))
    rng = np.random.default_rng(5)
    noise = rng.standard_normal((2, *signal.shape))
    np.save(path, (signal + noise[0] + 1j * noise[1]).astype(np.complex64))
    return RecordingSettings(
        format="npy",
        start_frequency_hz=CARRIER_HZ,
        slope_hz_per_s=60e12,
        sample_rate_hz=5e6,
        ramp_period_s=60e-6,
        adc_start_s=6e-6,
        samples="complex-1x",
        axes="ramps,antennas,samples",
        antenna_spacing_wavelengths=0.5,
        num_transmitters=num_transmitters,
    )


def test_a_recording_says_whether_objects_walk(tmp_path):
    settings = recorded(tmp_path / "walk.npy", 15.0)
    path = str(tmp_path / "walk.npy")
    frame, remarks = convert_recording(path, settings)
    assert frame.radar.range_migration
    assert any("within the frame, which is modelled" in remark for remark in remarks)
    solution = separated("object-only", frame.radar, frame.received)
    line = result_line(path, solution, frame.radar)
    (found,) = line["objects"]
    assert found["range_m"] == pytest.approx(8.0, abs=0.02)
    assert found["velocity_mps"] == pytest.approx(15.0, abs=0.02)
    frame, remarks = convert_recording(path, replace(settings, range_migration="neglected"))
    assert not frame.radar.range_migration
    assert any("range_migration: modelled, fewer ramps" in remark for remark in remarks)


def test_a_walk_is_visible_by_all_antennas_and_not_by_gaps():
    still = replace(RADAR, num_ramps=32, num_samples=128, range_migration=False)
    ramp, time = np.ogrid[: still.num_ramps, : still.num_samples]
    rng = np.random.default_rng(7)
    noise = rng.standard_normal((4, *still.shape, 2)) @ np.array([1.0, 1.0j]) / np.sqrt(2.0)
    strong = 25.0 * np.exp(-2j * np.pi * 0.2 * time) + 0.0 * ramp
    # 4096 samples: 51 dB at one antenna, 57 dB at four; satellites of a hundredth of a cell, 46 dB
    # below, are at 5 and 11 dB.
    doppler = 0.01 * still.one_cell_mps * 2.0 * CARRIER_HZ / SPEED_OF_LIGHT_MPS * 60e-6
    moving = 5.6 * np.exp(-2j * np.pi * (0.4 * time + doppler * ramp))
    assert visible_walker(noise + strong, still) is None
    assert visible_walker(noise[0] + strong + moving, still) is None
    walker = visible_walker(noise + strong + moving, still)
    assert walker.cells == pytest.approx(0.01, rel=0.05)
    assert walker.level_db == pytest.approx(57.1, abs=0.5)
    gaps = (noise + strong) * (np.abs(ramp * still.num_samples + time - 2000) > 300)
    assert visible_walker(gaps, still) is None


def test_angles_lack_the_motion_between_transmitters_that_take_turns(tmp_path):
    settings = recorded(tmp_path / "turns.npy", 4.0, 25.0, num_transmitters=2)
    frame, _ = convert_recording(str(tmp_path / "turns.npy"), settings)
    write_frame(tmp_path / "turns.npz", frame)
    frame = read_frame(tmp_path / "turns.npz")
    assert (frame.num_antennas, frame.num_transmitters) == (6, 2)
    model = model_of(frame.radar, 6)
    solution = run(make_estimator("object-only", model), frame.antennas)
    spacing = frame.antenna_spacing_wavelengths
    angles = [
        result_line("turns", solution, frame.radar, spacing, count)["objects"][0]["angle_deg"]
        for count in (2, 1)
    ]
    assert angles[0] == pytest.approx(25.0, abs=0.1)
    assert abs(angles[1] - 25.0) > 2.0
