"""gTNR and NSINR of range-Doppler maps."""

import numpy as np
import pytest

from vsep.analysis.map_metrics import gtnr, nsinr_db, target_cells
from vsep.analysis.signal_metrics import SIGNAL_METRICS, signal_metrics
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.mitigation.blanking import zeroed
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel

SHAPE = 16, 128
RNG = np.random.default_rng(3)


def noise():
    return RNG.standard_normal(SHAPE) + 1j * RNG.standard_normal(SHAPE)


def test_the_cells_of_an_object_go_around_the_unit_circle():
    cells = target_cells(np.array([-0.5]), np.array([0.49]), SHAPE)
    ramps, samples = np.nonzero(cells)
    assert set(samples.tolist()) == {0, 1, 127}
    assert set(ramps.tolist()) == {15, 0, 1}


def test_noise_alone_has_the_overlap_of_two_samples_of_one_distribution():
    targets = target_cells(RNG.uniform(-0.5, 0.5, 60), RNG.uniform(-0.5, 0.5, 60), SHAPE)
    num, others = targets.sum(), (~targets).sum()
    # The two-sample Kolmogorov statistic exceeds this in one of a thousand.
    limit = 1.95 * np.sqrt(1.0 / num + 1.0 / others)
    assert gtnr(noise(), targets) < limit


def test_the_overlap_is_that_of_the_distributions():
    # Exponential levels of mean 1 and 4: sup of exp(-x/4) - exp(-x), at x = 4 ln 4 / 3.
    at = 4.0 * np.log(4.0) / 3.0
    expected = np.exp(-at / 4.0) - np.exp(-at)
    targets = np.zeros(SHAPE, dtype=bool)
    targets[::2] = True
    values = [
        gtnr(np.fft.fft2(np.fft.ifftshift(np.where(targets, 2.0, 1.0) * noise())), targets)
        for _ in range(40)
    ]
    assert np.mean(values) == pytest.approx(expected, abs=0.02)


def test_a_map_without_targets_or_without_background_has_neither_metric():
    for everywhere in (True, False):
        targets = np.full(SHAPE, everywhere)
        assert np.isnan(gtnr(noise(), targets))
        assert np.isnan(nsinr_db(noise(), noise(), targets))


def test_twice_the_noise_costs_three_decibels_of_nsinr():
    spectrum = np.fft.fft2(noise())
    targets = np.zeros(SHAPE, dtype=bool)
    targets[3, 5] = True
    index = np.fft.ifftshift(targets)
    strong = np.where(index, 1e3, spectrum)
    twice = np.where(index, 1e3, np.sqrt(2.0) * spectrum)
    frames = [np.fft.fft2(one) for one in (twice, strong)]
    assert nsinr_db(*frames, targets) == pytest.approx(-10.0 * np.log10(2.0), abs=1e-9)


@pytest.mark.scenario
def test_gtnr_of_simulation_2_b_is_that_of_an_independent_trial():
    """An independent trial of 12 seeds: clean .745, received .435, zeroing .667, separation .752.

    Its scenes were the same, its details are not known: cells, window, mask and estimate of the
    overlap were chosen as those that come nearest to these values. The test keeps that choice.
    """
    found = []
    for seed in range(1, 13):
        scenario, observation = simulate_preset(
            "simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=seed
        )
        truth, received = observation.truth, observation.received
        model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
        solution = run(FactorisedSeparator(model=model), received)
        frames = (
            received - truth.interference_signal,
            received,
            zeroed(received, truth.interfered_samples()),
            solution.state.cleaned(received),
        )
        found.append([signal_metrics(truth, received, frame)["gtnr"] for frame in frames])
    assert np.mean(found, axis=0) == pytest.approx([0.745, 0.435, 0.667, 0.752], abs=0.01)


def test_every_metric_has_words_and_is_nan_without_a_truth():
    frame = noise()
    found = signal_metrics(None, frame, frame)
    assert found.keys() == SIGNAL_METRICS.keys()
    assert all(np.isnan(value) for value in found.values())
    assert all(metric.label and metric.help.endswith(".") for metric in SIGNAL_METRICS.values())
