import numpy as np
import pytest
from scipy.stats import binom, poisson

from tests.vsep import noise_bench as bench
from vsep.inference.core.noise_spectrum import (
    NoiseSpectrum,
    estimate_noise_spectrum,
    quiet_periodogram,
)
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.inference.objects.uncertainty import dispersion_std

SHAPE = 32, 256
COLOURED = [bench.filtered, bench.flicker, bench.sloped, bench.of_a_sensor]


def estimate(spectrum, seed, shape=SHAPE):
    rng = np.random.default_rng(seed)
    noise = bench.noise_of(spectrum, *shape, rng)
    return estimate_noise_spectrum(noise[None], bench.model_of(*shape))


def test_white_noise_stays_white():
    coloured = sum(estimate(bench.white, [1, seed], (16, 128)) is not None for seed in range(200))
    assert coloured <= 8  # of 200; the score of a first term is exceeded once in a hundred


@pytest.mark.parametrize("spectrum", COLOURED)
def test_the_spectrum_is_that_of_the_noise_where_a_line_could_be(spectrum):
    beats = np.fft.fftfreq(SHAPE[1])
    # What a line sees: the spectrum through the ramp's ends, the mean of many periodograms.
    rng = np.random.default_rng(2)
    rows = bench.noise_of(spectrum, 4000, SHAPE[1], rng)
    seen = np.mean(np.abs(np.fft.ifft(rows, axis=1, norm="ortho")) ** 2, axis=0)
    passed = seen > 0.1 * seen.max()
    error_db = 10.0 * np.log10(estimate(spectrum, 3).level(beats) / seen)[passed]
    assert np.sqrt(np.mean(error_db**2)) < 0.5
    assert np.abs(error_db).max() < 2.5


def test_the_quiet_periodogram_is_unbiased_and_does_not_see_a_few_lines():
    rng = np.random.default_rng(4)
    noise = bench.noise_of(bench.white, 64, 512, rng)
    _, lines = bench.lines_in(bench.white, 12, noise.shape, rng, snr_db=(10.0, 13.0))
    level, looks = quiet_periodogram((noise + lines)[None])
    deviation = 1.0 / np.sqrt(512 * looks)
    assert abs(level.mean() - 1.0) < 4.0 * deviation + 12 * 4.0 / (64 * 512)


def test_an_uncertain_level_is_exceeded_as_seldom_as_a_known_one():
    # A level that is Gamma-distributed around the truth, an exponential variable over it.
    rng = np.random.default_rng(5)
    threshold, variance = 6.0, 0.02
    levels = rng.gamma(1.0 / variance, variance, 400_000)
    spectrum = NoiseSpectrum(np.ones(4), np.full(4, variance))
    factor = spectrum.cautious_level(np.zeros(1), threshold)[0]
    expected = np.exp(-threshold)
    exceeded = np.mean(np.exp(-threshold * factor * levels))  # the exponential one in closed form
    assert exceeded == pytest.approx(expected, rel=0.02)
    assert np.mean(np.exp(-threshold * levels)) > 1.3 * expected


@pytest.mark.scenario
@pytest.mark.parametrize("estimator", [ObjectOnlySeparator, FactorisedSeparator])
@pytest.mark.parametrize("spectrum", [bench.white, *COLOURED])
def test_the_false_alarm_rate_holds_in_noise_of_any_spectrum(spectrum, estimator):
    shape, rate, frames = (16, 128), 0.5, 60
    separator = estimator(model=bench.model_of(*shape), false_alarm_rate=rate)
    alarms = bursts = converged = 0
    for seed in range(frames):
        rng = np.random.default_rng([6, seed])
        solution = run(separator, bench.noise_of(spectrum, *shape, rng))
        alarms += solution.objects.num_components
        bursts += len(solution.state.bursts)
        converged += solution.termination is Termination.CONVERGED
    # Between half and twice the rate, as far as so many frames can tell.
    assert poisson.cdf(alarms, 0.5 * rate * frames) > 0.025
    assert poisson.sf(alarms - 1, 2.0 * rate * frames) > 0.025
    assert poisson.sf(bursts - 1, 0.005 * frames * shape[0]) > 0.025
    assert converged >= 0.95 * frames


@pytest.mark.scenario
@pytest.mark.parametrize("spectrum", [bench.flicker, bench.of_a_sensor])
def test_deviations_cover_what_they_say_in_coloured_noise(spectrum):
    separator = ObjectOnlySeparator(model=bench.model_of(*SHAPE))
    inside = []
    for seed in range(20):
        rng = np.random.default_rng([7, seed])
        points, lines = bench.lines_in(spectrum, 12, SHAPE, rng)
        state = run(separator, lines + bench.noise_of(spectrum, *SHAPE, rng)).state
        std = dispersion_std(state.objects, state.effective_precision, SHAPE, state.relative_noise)
        for point in points:
            found = bench.nearest(state.objects, point, SHAPE)
            assert found is not None
            index, errors = found
            inside += [abs(errors[0]) < std.beats[index], abs(errors[1]) < std.dopplers[index]]
    # 68.3 % of independent errors lie within one deviation
    low, high = binom.interval(0.99, len(inside), 0.683)
    assert low <= np.sum(inside) <= high


@pytest.mark.scenario
def test_a_quiet_band_shows_weaker_objects_than_a_loud_one():
    separator = ObjectOnlySeparator(model=bench.model_of(*SHAPE))
    ramps, samples = np.arange(SHAPE[0])[:, None], np.arange(SHAPE[1])
    found = {0.02: 0, 0.4: 0}
    for seed in range(12):
        rng = np.random.default_rng([8, seed])
        received = bench.noise_of(bench.flicker, *SHAPE, rng)
        level = 10.0**1.8 * bench.flicker(
            np.array(0.4)
        )  # 18 dB in the quiet band, 8 dB in the other
        for beat in found:
            phase = rng.uniform() + beat * samples + 0.2 * ramps
            received = received + np.sqrt(level / received.size) * np.exp(-2j * np.pi * phase)
        objects = run(separator, received).objects
        for beat in found:
            found[beat] += objects.num_components > 0 and (
                bench.nearest(objects, (beat, 0.2), SHAPE) is not None
            )
    assert found[0.4] >= 11
    assert found[0.02] <= 2
