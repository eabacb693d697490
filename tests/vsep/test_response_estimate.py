"""The estimated response against a receiver whose response is known."""

import numpy as np
import pytest

from vsep.calibration.burst_windows import BurstWindow
from vsep.calibration.line_grid import LineGrid
from vsep.calibration.parametric import butterworth, fit_parametric
from vsep.calibration.response_estimate import estimate_response
from vsep.errors import InputError
from vsep.signal.filters import ButterworthFilter
from vsep.signal.template import SignalModel

RATE, SLOPE = 20e6, -19.312e12
HIGH_PASS_HZ, LOW_PASS_HZ = 0.345e6, 8.57e6


def known_response(frequency_hz):
    """Two antennas, the second later by a tenth of a sample."""
    response = butterworth(frequency_hz, HIGH_PASS_HZ, LOW_PASS_HZ)
    return np.stack([response, response * np.exp(-2j * np.pi * frequency_hz * 0.1 / RATE)])


def simulated_windows(*, num_bursts=16, noise=1e-3, seed=0):
    """Bursts of 144 samples by an integral over frequency ten times finer than the estimate's."""
    rng = np.random.default_rng(seed)
    frequency_hz = np.arange(-0.8 * RATE, 0.8 * RATE, RATE / 2560)
    windows = []
    for ramp in range(num_bursts):
        crossing = 200.0 + rng.uniform(-0.5, 0.5)
        times = (np.arange(172, 316) - crossing) / RATE
        spectrum = known_response(frequency_hz) * np.exp(-1j * np.pi * frequency_hz**2 / SLOPE)
        signals = spectrum @ np.exp(2j * np.pi * np.outer(frequency_hz, times)) / 500.0
        signals *= rng.uniform(0.5, 1.5) * np.exp(2j * np.pi * rng.uniform(size=(2, 1)))
        signals += noise * (rng.normal(size=signals.shape) + 1j * rng.normal(size=signals.shape))
        window = BurstWindow(
            ramp=ramp, crossing=crossing + rng.uniform(-1.0, 1.0), first=172, signals=signals
        )
        windows.append(window)
    return windows


@pytest.fixture(scope="module")
def windows():
    return simulated_windows()


@pytest.fixture(scope="module")
def estimate(windows):
    return estimate_response(windows, RATE, SLOPE)


def aligned_error(estimated, known, frequency_hz):
    """NMSE in the band after the delay and the phase that no burst shows; delay by a fine grid."""
    delays = np.linspace(-6.0, 6.0, 4001)[:, None] / RATE
    turned = known * np.exp(-2j * np.pi * frequency_hz * delays)
    share = np.abs(turned.conj() @ estimated) ** 2
    return 1.0 - share.max() / (np.vdot(known, known).real * np.vdot(estimated, estimated).real)


def test_the_response_of_every_antenna_is_found(estimate):
    frequency_hz = estimate.response.frequency_hz
    band = np.abs(frequency_hz) < 0.55 * RATE
    known = known_response(frequency_hz)
    for antenna in range(2):
        error = aligned_error(
            estimate.response.response[antenna, band], known[antenna, band], frequency_hz[band]
        )
        # 16 bursts 60 dB over the noise leave some -70 dB; the ridge of 1e-3 biases up to -60 dB
        # and by more beyond half the sample rate, where little is received.
        assert error < 1e-3


def test_delays_between_antennas_are_found(estimate):
    first, second = estimate.response.delays_s
    # A hundredth of a sample: the mean group delay weighs the noisy edges of the band little.
    assert second - first == pytest.approx(0.1 / RATE, abs=0.01 / RATE)


def test_bursts_are_reproduced(estimate):
    # Noise at 1e-3 a component against bursts of about one: -50 dB or better.
    errors = np.array([fit.errors for fit in estimate.fits])
    assert np.all(10.0 * np.log10(np.median(errors, axis=0)) < -40.0)


def test_the_band_is_coherent_and_the_rest_is_not(estimate):
    response = estimate.response
    offset = np.abs(response.frequency_hz)
    band = (offset > 0.02 * RATE) & (offset < 0.35 * RATE)  # nothing passes at zero
    beyond = offset > 0.75 * RATE
    assert response.coherence[:, band].min() > 0.9
    assert np.median(response.coherence[:, beyond]) < 0.5


def test_the_parametric_form_finds_both_filters(estimate):
    parametric = fit_parametric(estimate.response, RATE)
    assert parametric.high_pass_hz == pytest.approx(HIGH_PASS_HZ, rel=0.02)
    assert parametric.low_pass_hz == pytest.approx(LOW_PASS_HZ, rel=0.01)
    assert np.all(parametric.errors < 1e-3)


def test_the_phase_tells_the_slope_difference(windows):
    wrong = 1.04 * SLOPE
    response = estimate_response(windows, RATE, wrong).response
    bent = fit_parametric(response, RATE, free_bend=True)
    # 0.1 %: what the bias of the ridge at the edges of the band leaves; it was 4 % off.
    assert bent.corrected_slope(wrong) == pytest.approx(SLOPE, rel=1e-3)


def test_lines_make_the_burst_of_the_template():
    rate, slope, crossing = 5.1e6, 2.0e12, 40.3
    assumed = ButterworthFilter(cutoff_hz=1e6, order=8)
    model = SignalModel(
        num_ramps=1, num_samples=128, sample_rate_hz=rate, anti_aliasing_filter=assumed
    )
    normalised = slope / rate**2
    template = model.template(np.array([-normalised * crossing]), np.array([normalised]))[0]
    grid = LineGrid(size=512, sample_rate_hz=rate)
    values = assumed.response(grid.frequency_hz) * grid.chirp(crossing, slope)
    burst = grid.synthesize(values, 0, 128)
    share = np.abs(np.vdot(template, burst)) ** 2
    energies = np.vdot(template, template).real * np.vdot(burst, burst).real
    # The lines end at 0.8 sample rates, four cut-offs, where the filter is at -86 dB.
    assert share / energies == pytest.approx(1.0, abs=1e-7)


def test_projecting_is_the_adjoint_of_synthesizing():
    rng = np.random.default_rng(3)
    grid = LineGrid(size=64, sample_rate_hz=1.0)
    values = rng.normal(size=len(grid.lines)) + 1j * rng.normal(size=len(grid.lines))
    samples = rng.normal(size=20) + 1j * rng.normal(size=20)
    left = np.vdot(samples, grid.synthesize(values, -7, 20))
    right = np.vdot(grid.project(samples, -7), values)
    assert left == pytest.approx(right, rel=1e-12)


def test_too_few_bursts_are_refused(windows):
    with pytest.raises(InputError, match=r"5 bursts stand clear .* at least 8"):
        estimate_response(windows[:5], RATE, SLOPE)


def test_bursts_without_a_common_response_are_refused():
    rng = np.random.default_rng(4)
    noise = [
        BurstWindow(
            ramp=ramp,
            crossing=50.0,
            first=0,
            signals=rng.normal(size=(1, 120)) + 1j * rng.normal(size=(1, 120)),
        )
        for ramp in range(10)
    ]
    with pytest.raises(InputError, match="share one response"):
        estimate_response(noise, RATE, SLOPE)
