"""The estimator that keeps separation or masking, and the evidence that it goes by."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import digamma, gammaln

from tests.vsep import impaired_bench as bench
from vsep.inference.core.run import iterate, run
from vsep.inference.core.state import ObjectComponents
from vsep.inference.evidence_choice import Choice
from vsep.inference.objects.evidence import evidence_of_places
from vsep.inference.registry import make_estimator
from vsep.presets.scenes import preset_radar, simulate_preset
from vsep.signal.filters import NoFilter, RaisedCosineFilter
from vsep.signal.template import SignalModel

SMALL = SignalModel(
    num_ramps=6, num_samples=24, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
)


def at(beats, dopplers):
    """Objects at some places; nothing else of them counts."""
    count = len(beats)
    return ObjectComponents(
        component_ids=np.arange(count),
        beats=np.array(beats),
        dopplers=np.array(dopplers),
        amplitudes=np.zeros(count, dtype=complex),
        covariance=np.eye(count, dtype=complex),
        precisions=np.ones(count),
    )


def small_frame(seed, amplitude):
    rng = np.random.default_rng(seed)
    received = rng.normal(size=(6, 24, 2), scale=np.sqrt(0.5)) @ np.array([1.0, 1.0j])
    received += amplitude * line(0.11, -0.2)
    return received, rng.uniform(size=(6, 24)) < 0.7


def line(beat, doppler):
    ramp, sample = np.ogrid[:6, :24]
    return np.exp(-2j * np.pi * (beat * sample + doppler * ramp)) / 12.0


def dense_bound(logarithms, atoms, data):
    """(19) of L objects with every factor written out, at the best q(alpha) of gamma and lambda."""
    precisions, precision = np.exp(logarithms[:-1]), np.exp(logarithms[-1])
    covariance = np.linalg.inv(precision * atoms.conj().T @ atoms + np.diag(precisions))
    mean = precision * covariance @ atoms.conj().T @ data
    moments = np.abs(mean) ** 2 + np.diag(covariance).real
    error = np.sum(np.abs(data - atoms @ mean) ** 2)
    error += np.trace(atoms @ covariance @ atoms.conj().T).real
    # q(gamma) = Ga(1, 1/gamma), q(lambda) = Ga(n, n/lambda): means of the logarithms
    log_gammas = digamma(1.0) + np.log(precisions)
    count, n = len(precisions), len(data)
    log_lambda = digamma(n) - np.log(n / precision)
    likelihood = n * (log_lambda - np.log(np.pi)) - precision * error
    prior = np.sum(log_gammas - np.log(np.pi) - precisions * moments) - np.sum(log_gammas)
    entropy = count * np.log(np.pi * np.e) + np.linalg.slogdet(covariance)[1]
    entropy += np.sum(1.0 + np.log(precisions))  # of Ga(1, 1/gamma)
    of_lambda = n - np.log(n / precision) + gammaln(n) + (1 - n) * digamma(n) - log_lambda
    return likelihood + prior + entropy + of_lambda - count


def test_the_score_is_the_largest_dense_bound_less_what_fitted_places_cost():
    received, used = small_frame(1, 8.0)
    objects = at([0.11, 0.13], [-0.2, -0.1])
    received += 6.0 * line(0.13, -0.1)
    atoms = np.stack([line(0.11, -0.2)[used], line(0.13, -0.1)[used]], axis=1)
    best = minimize(
        lambda x: -dense_bound(x, atoms, received[used]),
        np.array([-3.0, -3.0, 0.0]),
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-10, "maxiter": 4000},
    )
    for share in (1.0, 0.4):
        score = evidence_of_places(objects, received, used, SMALL, share)
        assert score == pytest.approx(-best.fun - 2.0 * 2 * share, abs=1e-6)


def test_an_object_of_which_the_samples_tell_nothing_changes_nothing():
    received, used = small_frame(2, 8.0)
    # The projection of the second one on what is left is made zero.
    atoms = np.stack([line(0.11, -0.2)[used], line(-0.3, 0.3)[used]], axis=1)
    data = received[used]
    left = data - atoms @ np.linalg.lstsq(atoms, data, rcond=None)[0]
    received[used] = left + 8.0 * atoms[:, 0]
    one = evidence_of_places(at([0.11], [-0.2]), received, used, SMALL, 0.0)
    two = evidence_of_places(at([0.11, -0.3], [-0.2, 0.3]), received, used, SMALL, 0.0)
    none = evidence_of_places(at([], []), received, used, SMALL, 0.0)
    assert two == pytest.approx(one, abs=1e-6)
    assert one > none + 10.0


def test_antennas_add_up_and_their_weights_are_their_own():
    frames = [small_frame(seed, 8.0) for seed in (3, 4)]
    objects = at([0.11], [-0.2])
    both = evidence_of_places(
        objects,
        np.concatenate([frame[0] for frame in frames]),
        np.concatenate([frame[1] for frame in frames]),
        replace(SMALL, num_antennas=2),
        0.0,
    )
    alone = [evidence_of_places(objects, *frame, SMALL, 0.0) for frame in frames]
    assert both == pytest.approx(sum(alone), rel=1e-12)


def test_where_separation_is_kept_it_is_the_factorised_estimate_to_the_bit():
    radar = preset_radar("simulation-2-a")
    _, observation = simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=2)
    model = SignalModel.of_radar(
        radar, RaisedCosineFilter(cutoff_hz=0.25 * radar.sample_rate_hz, rolloff=0.25)
    )
    chosen = run(make_estimator("evidence", model), observation.received)
    alone = run(make_estimator("factorised", model), observation.received)
    assert chosen.state.choice is Choice.SEPARATION
    assert chosen.termination is alone.termination
    assert chosen.iterations > alone.iterations
    for name in ("beats", "dopplers", "amplitudes", "covariance"):
        np.testing.assert_array_equal(getattr(chosen.objects, name), getattr(alone.objects, name))
    np.testing.assert_array_equal(chosen.state.interference_signal, alone.state.interference_signal)


def test_without_interference_there_is_nothing_to_choose():
    rng = np.random.default_rng(5)
    noise = rng.normal(size=(*bench.SHAPE, 2)) @ np.array([1.0, 1.0j])
    chosen = run(make_estimator("evidence", bench.MODEL), noise)
    alone = run(make_estimator("factorised", bench.MODEL), noise)
    assert chosen.state.choice is Choice.SEPARATION
    assert chosen.iterations == alone.iterations


def test_masking_is_kept_where_separation_lost_an_object_and_can_be_resumed():
    name = "switched on or off in the band"
    for seed in range(7000, 7010):
        points, received = bench.scene(bench.IMPAIRED[name], seed)
        estimator = make_estimator("evidence", bench.MODEL)
        steps = list(iterate(estimator, received))
        last = steps[-1].state
        if last.choice is Choice.MASKING:
            break
    assert last.choice is Choice.MASKING
    assert last.evidence_nats < 0.0
    separated = run(make_estimator("factorised", bench.MODEL), received).objects
    assert bench.missed(last.objects, points) <= bench.missed(separated, points)
    # Samples that bursts reach hold what the objects predict.
    aside = last.sample_weights == 0.0
    assert 0.02 < aside.mean() < 0.5
    cleaned = last.cleaned(received)
    np.testing.assert_array_equal(cleaned[aside], last.object_signal[aside])
    again = run(estimator, received, steps[-3].state).state
    np.testing.assert_array_equal(again.objects.beats, last.objects.beats)
    assert again.choice is Choice.MASKING


def test_several_antennas_are_taken_together_and_missing_samples_stay_out():
    name = "switched on or off in the band"
    points, received = bench.scene(bench.IMPAIRED[name], 7003)
    noise = np.random.default_rng(1).normal(size=(*bench.SHAPE, 2)) @ np.array([0.5, 0.5j])
    missing = np.zeros((2, *bench.SHAPE), dtype=bool)
    missing[:, 3:5] = True
    together = make_estimator("evidence", replace(bench.MODEL, num_antennas=2), missing=missing)
    solution = run(together, np.stack([received, 1j * received + noise]))
    assert solution.state.choice is not None
    assert np.isfinite(solution.state.evidence_nats)
    assert bench.missed(solution.objects, points) < 8
    rows = missing.reshape(-1, bench.SHAPE[1])
    assert not solution.state.sample_weights[rows].any()


QUICK = "clipped"


@pytest.mark.scenario
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == QUICK else pytest.mark.slow)
        for name in bench.IMPAIRED
    ],
)
def test_the_choice_misses_no_more_than_either(name):
    missed = []
    for seed in range(6):
        points, received = bench.scene(bench.IMPAIRED[name], [11, seed])
        separated = run(make_estimator("factorised", bench.MODEL), received)
        chosen = run(make_estimator("evidence", bench.MODEL), received)
        missed.append([bench.missed(each.objects, points) for each in (chosen, separated)])
    chosen, separated = np.mean(missed, axis=0)
    assert chosen <= separated + 0.3
