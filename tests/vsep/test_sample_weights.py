import numpy as np
import pytest

from tests.vsep import impaired_bench as bench
from vsep.inference.bursts.sample_weights import sample_weights
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.masked import MaskedSeparator
from vsep.mitigation.masks.detectors import detect_interference


def noise_and_burst(kappa, seed=1):
    """Noise of power one and a burst in ramp 3, of which the model lacks a share of kappa."""
    rng = np.random.default_rng(seed)
    draws = rng.standard_normal((4, 8, 256)) / np.sqrt(2.0)
    burst = np.zeros((8, 256), dtype=np.complex128)
    burst[3, 100:140] = 100.0 * np.exp(2j * np.pi * 0.01 * np.arange(40) ** 2)
    lacking = np.sqrt(kappa) * burst * (draws[2] + 1j * draws[3])
    return draws[0] + 1j * draws[1] + burst + lacking, burst


def test_without_evidence_every_sample_counts():
    nothing = np.zeros((8, 256), dtype=np.complex128)
    for seed in range(20):
        received, burst = noise_and_burst(0.0, seed)
        assert sample_weights(received, nothing, burst, fitted=True) is None


def test_a_sample_counts_by_the_share_of_the_noise_in_its_variance():
    received, burst = noise_and_burst(3e-4)
    nothing = np.zeros_like(burst)
    values = sample_weights(received, nothing, burst, fitted=True).values
    # 1 / (1 + 3e-4 * 100^2) = 0.25; kappa is measured from forty samples.
    assert values[3, 104:136] == pytest.approx(0.25, rel=0.5)
    # The burst's power, averaged over five samples, ends two samples beside it.
    assert np.all(values[3, :98] == 1.0)
    assert np.all(values[3, 142:] == 1.0)
    assert np.all(np.delete(values, 3, axis=0) == 1.0)


def test_what_is_set_aside_is_what_the_objects_predict_in_the_cleaned_frame():
    _, received = bench.scene(bench.IMPAIRED["switched on or off in the band"], 5)
    state = run(FactorisedSeparator(model=bench.MODEL), received).state
    aside = state.sample_weights == 0.0
    assert aside.any()
    cleaned = state.cleaned(received)
    np.testing.assert_array_equal(cleaned[aside], state.object_signal[aside])
    whole = state.sample_weights == 1.0
    np.testing.assert_allclose(
        cleaned[whole], (received - state.interference_signal)[whole], rtol=0, atol=1e-10
    )
    # Unexplained clicks of a burst 60 dB over the noise do not stay in it.
    assert np.abs(cleaned - state.object_signal).max() ** 2 * state.noise_precision < 40.0


@pytest.mark.scenario
@pytest.mark.parametrize("name", bench.IMPAIRED)
def test_separation_misses_no_more_than_ignoring_the_bursts(name):
    more, converged, frames = [], 0, 4
    for seed in range(frames):
        points, received = bench.scene(bench.IMPAIRED[name], [9, seed])
        separated = run(FactorisedSeparator(model=bench.MODEL), received)
        mask = detect_interference("residual", received)
        ignoring = run(MaskedSeparator(model=bench.MODEL, mask=mask), received)
        more.append(
            bench.missed(separated.objects, points) - bench.missed(ignoring.objects, points)
        )
        converged += separated.termination is Termination.CONVERGED
    # At most 0.3 of 30 objects more, as far as four frames can tell (normal, one-sided 97.5 %).
    assert np.mean(more) - 1.96 * max(np.std(more, ddof=1), 0.5) / np.sqrt(frames) <= 0.3
    assert converged == frames
