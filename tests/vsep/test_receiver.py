"""Image factors, offsets and skirts against dense formulas; whole runs with a bad receiver."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import binom

from tests.vsep import oscillator_bench as bench
from vsep.inference.core.image_estimate import _agreed
from vsep.inference.core.progress import Termination
from vsep.inference.core.receiver import PhasePrior, no_errors
from vsep.inference.core.run import iterate, run
from vsep.inference.core.skirt import WIDTHS, skirt_terms
from vsep.inference.deviations import state_deviations
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.masked import MaskedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.scenes import simulate_preset
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.template import SignalModel

SEPARATOR = ObjectOnlySeparator(model=bench.MODEL)
ALL = bench.IMPAIRED["all"]


def dense_periodogram(covariance):
    """Expected periodogram of rows with a covariance matrix."""
    size = len(covariance)
    transform = np.fft.ifft(np.eye(size), axis=0, norm="ortho")
    return np.einsum("kn,nm,km->k", transform, covariance, transform.conj()).real


def test_skirts_are_the_expected_periodograms_of_turned_lines():
    size, beats, powers = 48, np.array([0.13, -0.301]), np.array([3.0, 0.4])
    terms = skirt_terms(beats, powers, size)
    samples = np.arange(size)
    for width, term in zip((*WIDTHS, None), terms, strict=True):
        white = width is None
        decay = samples == 0 if white else np.exp(-2.0 * np.pi * width * samples / size)
        theta = toeplitz(decay.astype(np.float64))
        rows = [np.exp(-2j * np.pi * beat * samples) for beat in beats]
        lines = sum(p * np.outer(row, row.conj()) for p, row in zip(powers, rows, strict=True))
        np.testing.assert_allclose(term, dense_periodogram(lines * theta), atol=1e-12 * size)


def test_trend_and_spectrum_of_a_prior_are_those_of_its_covariance():
    size = 40
    prior = PhasePrior(jitter_std=0.3, noise_std=0.2, half_width=0.03)
    samples = np.arange(size)
    within = 0.04 * toeplitz(np.exp(-2.0 * np.pi * 0.03 * samples))
    mean = np.full(size, 1.0 / size)
    slope = np.linalg.pinv(np.vander(samples, 2))[0]
    assert prior.mean_variance(size) == pytest.approx(0.09 + mean @ within @ mean)
    assert prior.trend_variance(size) == pytest.approx(slope @ within @ slope)
    found = prior.spectrum(np.fft.fftfreq(size), size)
    np.testing.assert_allclose(found, dense_periodogram(within + 0.09), rtol=1e-9, atol=1e-12)


def test_an_object_at_the_image_of_another_is_no_image_factor():
    told, precisions = np.zeros(5, dtype=np.complex128), np.array([1e6, 8e5, 5e5, 1e5, 1e3])
    told[0] = 0.02j  # the strongest seems to have an image; the others should, and have none
    assert _agreed(told, precisions) == 0.0
    told[:] = 0.02j
    told[1] = 0.09  # one of them has another object at its image
    assert abs(_agreed(told, precisions) - 0.02j) < 1e-12


@pytest.mark.parametrize("antennas", [1, 3])
def test_a_corrected_frame_is_the_ideal_one(antennas):
    rng = np.random.default_rng(1)
    ideal = bench.noise((antennas * 4, 16), rng)
    errors = replace(
        no_errors(4, antennas),
        phases=rng.normal(0.0, 0.3, (4, 16)),
        prior=PhasePrior(noise_std=0.3, half_width=0.1),
        image_factors=0.1 * bench.noise((antennas,), rng),
        offsets=bench.noise((antennas,), rng),
    )
    frame = ideal.reshape(antennas, 4, 16)
    turned = np.exp(1j * errors.phases) * frame
    received = turned + errors.image_factors[:, None, None] * turned.conj()
    received = (received + errors.offsets[:, None, None]).reshape(ideal.shape)
    np.testing.assert_allclose(errors.corrected(received), ideal, atol=1e-12)
    one = errors.of_antenna(antennas - 1).corrected(received[-4:])
    np.testing.assert_allclose(one, ideal[-4:], atol=1e-12)


@pytest.mark.scenario
@pytest.mark.parametrize("name", bench.IMPAIRED)
def test_a_bad_receiver_makes_no_false_objects_and_hides_none(name):
    false = missed = hidden = inside = total = 0
    frames = 12
    for seed in range(frames):
        points, _, received, truth = bench.scene(bench.IMPAIRED[name], [20, seed])
        solution = run(SEPARATOR, received)
        assert solution.termination is Termination.CONVERGED
        errors = bench.false_and_missed(solution.objects, points)
        false, missed = false + errors[0], missed + errors[1]
        perfect = run(SEPARATOR, bench.scene(None, [20, seed])[2])
        hidden += bench.false_and_missed(perfect.objects, points)[1]
        inside += np.array(bench.within_a_deviation(solution.state, points))
        total += bench.NUM_OBJECTS
        receiver = solution.state.receiver
        if truth.image_factor:
            assert abs(receiver.image_factors[0] - truth.image_factor) < 1e-3
        if truth.offset:
            assert abs(receiver.offsets[0] - truth.offset) < 0.1
    assert false <= frames // 2
    # Phase noise hides what only its prior could tell from it.
    hides = bench.IMPAIRED[name].phase_noise_rad > 0.0
    assert missed - hidden <= frames * (1.0 if hides else 0.1)
    assert inside.min() >= binom.ppf(1e-3, total - missed, 0.66)


@pytest.mark.scenario
def test_a_perfect_receiver_is_left_alone():
    for seed in range(60):
        state = run(SEPARATOR, bench.scene(None, [21, seed])[2]).state
        assert state.receiver is None


@pytest.mark.scenario
def test_bursts_and_a_bad_receiver_are_separated_together():
    separator = FactorisedSeparator(model=bench.MODEL)
    false = missed = 0
    for seed in range(3):
        points, _, received, truth = bench.scene(ALL, [22, seed], share_of_ramps=0.5)
        state = run(separator, received).state
        errors = bench.false_and_missed(state.objects, points)
        false, missed = false + errors[0], missed + errors[1]
        assert abs(state.receiver.image_factors[0] - truth.image_factor) < 1e-3
        phases = state.receiver.phases.mean(axis=1)
        ramps = np.arange(len(phases))
        left = truth.ramp_phases_rad - phases
        left = left - np.polyval(np.polyfit(ramps, left, 1), ramps)
        assert np.std(left) < 1e-3
    assert false <= 1
    assert missed <= 9


def test_masked_samples_tell_nothing_of_the_receiver():
    points, _, received, truth = bench.scene(ALL, [23, 0])
    mask = np.random.default_rng(24).uniform(size=bench.SHAPE) < 0.2
    state = run(MaskedSeparator(model=bench.MODEL, mask=mask), np.where(mask, 1e3, received)).state
    assert bench.false_and_missed(state.objects, points)[0] <= 1
    assert abs(state.receiver.image_factors[0] - truth.image_factor) < 1e-3


def test_a_run_with_a_bad_receiver_can_be_resumed_bit_for_bit():
    received = bench.scene(ALL, [25, 0])[2]
    states = [step.state for step in iterate(SEPARATOR, received)]
    middle = next(state for state in states if state.receiver is not None)
    again = run(SEPARATOR, received, middle).state
    np.testing.assert_array_equal(again.object_signal, states[-1].object_signal)
    np.testing.assert_array_equal(again.receiver.phases, states[-1].receiver.phases)


def test_the_letter_of_the_paper_knows_no_receiver():
    separator = FactorisedSeparator(model=bench.MODEL, schedule="paper", max_iterations=8)
    assert run(separator, bench.scene(ALL, [26, 0])[2]).state.receiver is None


def test_deviations_are_those_of_the_objects_without_any_error():
    state = run(SEPARATOR, bench.scene(None, [27, 0])[2]).state
    jittered = replace(no_errors(*bench.SHAPE[:1], 1), prior=PhasePrior(jitter_std=0.01))
    usual = state_deviations(state, bench.SHAPE)
    more = state_deviations(replace(state, receiver=jittered), bench.SHAPE)
    trend = jittered.doppler_variance(bench.SHAPE[1])
    # the strongest object has the trend of the phases on top of its own
    strongest = np.argmax(state.objects.powers)
    assert more.dopplers[strongest] ** 2 - usual.dopplers[strongest] ** 2 == pytest.approx(
        trend, rel=0.05
    )
    assert np.all(more.dopplers**2 <= 2.0 * usual.dopplers**2 + trend + 1e-18)


def test_antennas_share_the_phases_and_have_offsets_of_their_own():
    scenario, seen = simulate_preset_antennas(
        "simulation-2-a",
        UniformLinearArray(num_antennas=3),
        snr_db=75.0,
        sir_db=0.0,
        seed=5,
        interference=False,
        phase_jitter_rad=5e-3,
        iq_gain_db=0.5,
        iq_phase_deg=3.0,
        dc_offset=5.0,
    )
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter, 3)
    state = run(ObjectOnlySeparator(model=model), seen.received).state
    truth, receiver = seen.truth.receiver, state.receiver
    assert state.objects.num_components == len(seen.truth.beats)
    np.testing.assert_allclose(receiver.image_factors, truth.image_factor, atol=1e-3)
    # of 3 * 2048 samples: 5 deviations of the mean of an antenna's
    limit = 5.0 / np.sqrt(2048 * seen.truth.noise_precision)
    assert np.abs(receiver.offsets - truth.offset).max() < limit
    ramps = np.arange(16)
    left = receiver.phases[:, 0] - truth.ramp_phases_rad
    left -= np.polyval(np.polyfit(ramps, left, 1), ramps)
    assert np.std(left) < 1e-3
    cleaned = state.cleaned(seen.received.reshape(48, 128)).reshape(3, 16, 128)
    error = cleaned - seen.truth.object_signal
    # what is left is noise, but for what a mean and a trend of the phases do
    assert np.median(np.abs(error) ** 2) * seen.truth.noise_precision < 2.0


@pytest.mark.scenario
@pytest.mark.parametrize("seed", [12, 13, 14])
def test_images_of_bursts_go_with_those_of_objects(seed):
    errors = {"iq_gain_db": 0.5, "iq_phase_deg": 3.0, "dc_offset": 5.0}
    levels = {"snr_db": 60.0, "sir_db": -20.0, "seed": seed}
    scenario, seen = simulate_preset("simulation-2-a", **levels, **errors)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    solution = run(FactorisedSeparator(model=model), seen.received)
    assert solution.termination is Termination.CONVERGED
    assert abs(solution.objects.num_components - len(seen.truth.beats)) <= 1
    true_slopes = {np.sign(burst.slope_hz_per_s) for burst in seen.truth.bursts}
    assert {np.sign(burst.slope) for burst in solution.state.bursts} == true_slopes
