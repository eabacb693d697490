"""Dithered ramps beside moving objects, repairs, maps and several transmitters."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.analysis.crlb import dispersion_bound
from vsep.errors import InputError
from vsep.inference.core.run import run
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.mitigation.masks.detectors import detect_interference
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import MITIGATIONS, make_mitigation
from vsep.mitigation.sparse.operators import DOMAINS, make_operator
from vsep.presets.scenes import simulate_preset
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import RecordingSettings
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.dithering import parse_starts
from vsep.signal.doppler_division import DopplerDivision, divided_scene
from vsep.signal.filters import NoFilter
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel, GroundTruth, Scene
from vsep.signal.simulate import simulate_antennas
from vsep.signal.spectra import hann_window, range_doppler_map
from vsep.signal.template import SignalModel
from vsep.waveforms.doppler_division import join_lines

CARRIER_HZ, SLOPE, RATE, PERIOD_S = 77e9, 1.5e13, 2.5e6, 60e-6
SHAPE = 48, 96
RADAR = ChirpSequence(
    start_frequency_hz=CARRIER_HZ,
    slope_hz_per_s=SLOPE,
    sample_rate_hz=RATE,
    ramp_period_s=PERIOD_S,
    num_samples=SHAPE[1],
    num_ramps=SHAPE[0],
    range_migration=True,
    start_times_s=parse_starts("start_times_s", "uniform 4e-6 1", SHAPE[0]),
    start_frequencies_hz=parse_starts("start_frequencies_hz", "uniform 5e6 2", SHAPE[0]),
)
MODEL = SignalModel.of_radar(RADAR, NoFilter())
RANGES_M, VELOCITIES_MPS = np.array([8.0, 5.0, 12.3, 3.0]), np.array([15.0, 3.0, -22.0, 28.0])
LEVELS = np.array([1.0, 0.8, 0.6, 0.3])


def of_moving_points():
    """Frame (P, N) by each point's distance at the true time and the true frequency swept there."""
    fast_s = np.arange(SHAPE[1]) / RATE
    start_s = np.arange(SHAPE[0])[:, None] * PERIOD_S + np.array(RADAR.start_times_s)[:, None]
    middle_s = 0.5 * (SHAPE[0] - 1) * PERIOD_S + 0.5 * (SHAPE[1] - 1) / RATE
    swept_hz = CARRIER_HZ + np.array(RADAR.start_frequencies_hz)[:, None] + SLOPE * fast_s
    frame = np.zeros(SHAPE, dtype=np.complex128)
    for metres, speed, level in zip(RANGES_M, VELOCITIES_MPS, LEVELS, strict=True):
        delays_s = 2.0 * (metres + speed * (start_s + fast_s - middle_s)) / SPEED_OF_LIGHT_MPS
        frame += level / np.sqrt(frame.size) * np.exp(-2j * np.pi * swept_hz * delays_s)
    return frame


def noise(seed, level):
    draws = np.random.default_rng(seed).standard_normal((2, *SHAPE))
    return level * (draws[0] + 1j * draws[1]) / np.sqrt(2.0)


def test_moving_points_of_dithered_ramps_are_one_object_each_at_the_bound():
    level = 10.0 ** (-45.0 / 20.0)
    beats = RADAR.beat_from_delay(2.0 * RANGES_M / SPEED_OF_LIGHT_MPS)
    dopplers = 2.0 * VELOCITIES_MPS * CARRIER_HZ / SPEED_OF_LIGHT_MPS * PERIOD_S
    truth = GroundTruth(
        beats=beats,
        dopplers=dopplers,
        amplitudes=LEVELS.astype(np.complex128),
        object_signal=of_moving_points(),
        interference_signal=np.zeros(SHAPE, dtype=np.complex128),
        bursts=(),
        noise_precision=level**-2.0,
    )
    bound, errors = dispersion_bound(truth, MODEL), []
    for seed in range(3):
        received = of_moving_points() + noise(seed, level)
        found = run(ObjectOnlySeparator(model=MODEL), received).objects
        assert found.num_components == 4
        nearest = np.argmin(np.abs(found.beats[:, None] - beats), axis=0)
        errors += [
            (found.beats[nearest] - beats) / bound.beats,
            (found.dopplers[nearest] - dopplers) / bound.dopplers,
        ]
    # 24 errors: a chi-square law lies within [9.9, 45.6] in 99 %.
    assert 9.9 < np.sum(np.square(errors)) < 45.6


def test_the_map_of_a_moving_point_peaks_with_its_whole_power():
    dither, resting = RADAR.dither, replace(RADAR, range_migration=False).dither
    beat, doppler = 24 / SHAPE[1], 12 / SHAPE[0]
    atom = dither.moving_atoms(np.array([[beat, doppler]]), SHAPE[1])[0]
    for along in (None, doppler):
        seen = range_doppler_map(atom, 2, "rectangular", migration=dither, doppler=along)
        row, column = np.unravel_index(seen.power.argmax(), seen.power.shape)
        assert (seen.dopplers[row], seen.beats[column]) == (doppler, beat)
        assert seen.power.max() == pytest.approx(1.0, abs=2e-3)
    other = range_doppler_map(atom, 2, "rectangular", migration=resting)
    assert other.power.max() < 0.97


def test_neglected_motion_leaves_the_starts_of_the_ramps():
    estimator = ObjectOnlySeparator(model=MODEL, range_migration="neglected")
    resting = replace(RADAR, range_migration=False).dither
    assert estimator.model.migration == resting
    assert RADAR.dither.motion.coupling > 0.0 == resting.motion.coupling


def gap_error_db(method, observation, **settings):
    mask = observation.truth.perfect_mask()
    cleaned = mitigate(make_mitigation(method, **settings), observation.received, mask).cleaned
    window = np.outer(*(hann_window(count) for count in mask.shape)) * mask
    truth = observation.truth.object_signal
    error = np.sum(np.abs(window * (cleaned - truth)) ** 2)
    return 10.0 * np.log10(error / np.sum(np.abs(window * truth) ** 2))


@pytest.mark.parametrize("method", ["mca-2d", "iht", "ist", "omp", "gamp", "pm-ist"])
def test_what_looks_across_ramps_fills_gaps_where_it_knows_how_they_were_dithered(method):
    scenario, observation = simulate_preset("dithered-ramps", snr_db=50.0, sir_db=-20.0, seed=1)
    known = gap_error_db(method, observation, dither=scenario.radar.dither)
    assert known < -14.0
    assert known < gap_error_db(method, observation) - 8.0


def test_interpolation_across_ramps_reads_the_same_frequency_of_their_sweeps():
    radar = simulate_preset("dithered-ramps", snr_db=50.0, sir_db=-20.0, seed=1)[0].radar
    # Objects at rest: across equal ramps a straight line is right, so only the starts matter.
    beats, weights = np.array([0.05, 0.12, 0.2]), np.array([1.0, 0.7j, 0.5])
    samples, starts = np.arange(256), np.array(radar.dither.start_samples)[:, None, None]
    frame = np.exp(-2j * np.pi * beats * (samples[:, None] + starts)) @ weights
    mask = np.random.default_rng(0).uniform(size=frame.shape) < 0.05
    mask[:, 100:112] = np.arange(32)[:, None] % 4 == 1
    inside = mask.copy()
    inside[:, :24] = inside[:, -24:] = False  # other ramps may not reach as far
    errors = []
    for dither in (radar.dither, None):
        cleaned = mitigate(make_mitigation("slow-time", dither=dither), frame, mask).cleaned
        errors.append(np.sqrt(np.mean(np.abs(cleaned - frame)[inside] ** 2)))
    assert errors[0] < 0.02
    assert errors[1] > 0.3


def test_methods_of_single_ramps_take_no_starts():
    takers = {name for name, entry in MITIGATIONS.items() if "dither" in entry.settings}
    assert not takers & {"zeroing", "blanking", "linear", "autoregressive", "noise-canceller"}
    with pytest.raises(InputError, match="zeroing takes none"):
        make_mitigation("zeroing", dither=RADAR.dither)


def test_both_forms_of_the_operator_are_one_for_dithered_ramps():
    rng = np.random.default_rng(2)
    mask = rng.uniform(size=(6, 10)) < 0.4
    dither = RampDither(
        start_ramps=tuple(rng.uniform(-0.1, 0.1, 6)), start_samples=tuple(rng.uniform(-4, 4, 6))
    )
    masked, explicit = (make_operator(each, mask, np.complex128, dither) for each in DOMAINS)
    spectrum = rng.standard_normal((2, 6, 10)).T @ np.array([1.0, 1.0j])
    spectrum = spectrum.T.copy()
    samples = masked.forward(spectrum)
    np.testing.assert_allclose(explicit.forward(spectrum.ravel()), samples[~mask], atol=1e-13)
    again = masked.forward(masked.adjoint(samples))  # its rows are orthonormal
    np.testing.assert_allclose(again, samples, atol=1e-13)
    cells = np.array([3, 17, 44])
    products = [each.inner_products(cells, cells[1:]) for each in (masked, explicit)]
    np.testing.assert_allclose(*products, atol=1e-13)


def test_the_residual_of_the_objects_sees_bursts_in_dithered_ramps():
    scenario, observation = simulate_preset("dithered-ramps", snr_db=50.0, sir_db=0.0, seed=2)
    truth = observation.truth
    loud = np.abs(truth.interference_signal) ** 2 * truth.noise_precision > 10.0
    quiet = np.abs(truth.interference_signal) ** 2 * truth.noise_precision < 0.1
    mask = detect_interference("residual", observation.received, scenario.radar.dither)
    assert np.mean(mask[loud]) > 0.95
    assert np.mean(mask[quiet]) < 0.05


def test_transmitters_with_phase_steps_may_start_at_other_frequencies_not_times():
    radar = replace(RADAR, range_migration=False, start_times_s=())
    ranges_m, speeds = np.array([2.5, 6.0, 11.0]), np.array([-2.0, 3.1, 0.4])
    objects = Channel(
        delays_s=2.0 * ranges_m / SPEED_OF_LIGHT_MPS,
        dopplers_hz=2.0 * speeds * CARRIER_HZ / SPEED_OF_LIGHT_MPS,
        weights=np.array([1.0, 0.5j, -0.3]),
    )
    scene = AntennaScene(
        scene=Scene(objects=objects, snr_db=45.0),
        antennas=UniformLinearArray(num_antennas=2),
        object_angles_deg=np.array([-25.0, 5.0, 40.0]),
        interferer_angles_deg=np.zeros(0),
    )
    waveform = DopplerDivision(num_transmitters=2, num_bands=3)
    divided = divided_scene(scene, radar, waveform)
    rng = np.random.default_rng(3)
    made = simulate_antennas(radar, divided, anti_aliasing_filter=NoFilter(), rng=rng)
    model = SignalModel.of_radar(radar, NoFilter(), 2)
    state = run(ObjectOnlySeparator(model=model), model.check(made.received)).state
    joined = join_lines(made.received, state, radar, waveform)
    order = np.argsort(joined.beats)
    assert joined.lines.min() >= 0
    assert radar.range_from_beat(joined.beats)[order] == pytest.approx(ranges_m, abs=0.02)
    assert radar.velocity_from_doppler(joined.dopplers)[order] == pytest.approx(speeds, abs=0.02)
    steering = UniformLinearArray(num_antennas=4).steering(np.array([-25.0, 5.0, 40.0]))
    weights = joined.amplitudes[order]
    np.testing.assert_allclose(weights / weights[:, :1], steering, atol=0.1)
    late = replace(radar, start_times_s=RADAR.start_times_s)
    with pytest.raises(InputError, match="start times are dithered"):
        join_lines(made.received, state, late, waveform)
    with pytest.raises(InputError, match="ramps must start at equal times"):
        divided_scene(scene, late, waveform)


def test_transmitters_that_take_turns_may_be_dithered_from_turn_to_turn(tmp_path):
    path = str(tmp_path / "ramps.npy")
    frame = np.random.default_rng(0).standard_normal((2, 16, 32)).T @ np.array([1.0, 1.0j])
    np.save(path, frame.T)
    settings = RecordingSettings(
        format="npy",
        axes="ramps,samples",
        start_frequency_hz=CARRIER_HZ,
        slope_hz_per_s=SLOPE,
        sample_rate_hz=RATE,
        ramp_period_s=PERIOD_S,
        num_transmitters=2,
        start_frequencies_hz="uniform 5e6 2",
    )
    starts = parse_starts("start_frequencies_hz", "uniform 5e6 2", 8)
    radar = converted(path, settings).radar
    assert (radar.start_frequencies_hz, radar.ramp_period_s) == (starts, 2.0 * PERIOD_S)
    each = ",".join(f"{start!r},{start!r}" for start in starts)
    assert converted(path, replace(settings, start_frequencies_hz=each)).radar == radar
    ramp_by_ramp = ",".join(str(1e5 * number) for number in range(16))
    with pytest.raises(InputError, match="differs between the 2 transmitters of a turn"):
        converted(path, replace(settings, start_frequencies_hz=ramp_by_ramp))


def converted(path, settings):
    frame, _ = convert_recording(path, settings)
    return frame
