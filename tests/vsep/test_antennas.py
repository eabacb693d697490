"""Several antennas: posteriors, costs and thresholds against dense formulas, and whole runs."""

import numpy as np
import pytest
from scipy.stats import gamma

from tests.vsep import antenna_bench as bench
from vsep.analysis.intervals import binomial_interval, poisson_interval
from vsep.errors import InputError
from vsep.inference.core.elbo import weights_bound
from vsep.inference.core.run import run
from vsep.inference.core.thresholds import threshold_from_false_alarm_rate, threshold_of_sum
from vsep.inference.objects.measurement_vectors import MultipleVectorActiveSet
from vsep.inference.objects.sbl import ActiveSet
from vsep.inference.registry import make_estimator
from vsep.kernels.complex_parts import split
from vsep.kernels.joint_slopes import joint_slopes
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.newton_ascent import ascend, update_lines
from vsep.kernels.object_cost import cost_jet
from vsep.kernels.object_posterior import object_signals, place_columns
from vsep.signal.atoms import gram, line_factors, project, synthesize
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel

NUM_ANTENNAS = 3
SHAPE = (5, 16)
NOISE_PRECISION = 2.0


@pytest.fixture(scope="module")
def crowded():
    """Three close objects at three antennas: points, precisions, residual (A, P, N)."""
    rng = np.random.default_rng(3)
    points = np.array([[0.1, 0.1], [0.14, 0.16], [-0.2, -0.3]])
    weights = 4.0 * (rng.standard_normal((3, NUM_ANTENNAS)) + 1j * rng.standard_normal((3, 3)))
    noise = rng.standard_normal((2, NUM_ANTENNAS, *SHAPE))
    signals = np.array([synthesize(w, *frame_factors(points)) for w in weights.T])
    return points, np.array([0.05, 0.1, 0.2]), signals + 0.5 * (noise[0] + 1j * noise[1])


def frame_factors(points):
    return line_factors(points[:, 0], SHAPE[1]), line_factors(points[:, 1], SHAPE[0])


def shared_set(points, precisions, residual):
    factors = frame_factors(points)
    products = np.array([project(signal, *factors) for signal in residual]).T
    return MultipleVectorActiveSet(gram(*factors), products, precisions, NOISE_PRECISION), factors


def as_columns(shared, factors):
    return Columns(*factors, shared.covariance, shared.amplitudes.copy(), NOISE_PRECISION)


def flat(residual):
    """The antennas' ramps below each other, as the kernels take them."""
    return residual.reshape(-1, SHAPE[1])


def shared_cost_jet(beat, doppler, precision, residual, columns):
    return cost_jet(beat, doppler, precision, split(flat(residual)), columns_as_parts(columns))


def update_shared(points, shared, residual, threshold):
    columns = as_columns(shared, frame_factors(points))
    levels = np.ones(len(points))
    return update_lines(points, shared.precisions, flat(residual), columns, threshold, levels)


def dense_atoms(points):
    """(P N, L) atoms, written out."""
    ramps, samples = np.mgrid[: SHAPE[0], : SHAPE[1]]
    atoms = [np.exp(-2j * np.pi * (b * samples + d * ramps)).ravel() for b, d in points]
    return np.array(atoms).T / np.sqrt(SHAPE[0] * SHAPE[1])


def dense_evidence(points, precisions, residual):
    """Log density of all antennas' samples, up to a constant: each CN(0, 1/lambda + A A^H)."""
    atoms = dense_atoms(points)
    covariance = np.eye(len(atoms)) / NOISE_PRECISION + (atoms / precisions) @ atoms.conj().T
    fits = [
        np.vdot(r.ravel(), np.linalg.solve(covariance, r.ravel())).real for r in np.array(residual)
    ]
    return -len(residual) * np.linalg.slogdet(covariance)[1] - sum(fits)


def test_shared_posterior_is_that_of_every_antenna_alone(crowded):
    points, precisions, residual = crowded
    shared, factors = shared_set(points, precisions, residual)
    alone = [
        ActiveSet(gram(*factors), shared.projections[:, a], precisions, NOISE_PRECISION)
        for a in range(NUM_ANTENNAS)
    ]
    for a, one in enumerate(alone):
        np.testing.assert_allclose(shared.amplitudes[:, a], one.amplitudes, rtol=1e-12)
        np.testing.assert_allclose(shared.covariance, one.covariance, rtol=1e-12)
    assert shared.cost() == pytest.approx(sum(one.cost() for one in alone), rel=1e-12)
    assert shared.trace() == pytest.approx(sum(one.trace() for one in alone), rel=1e-12)
    signals = object_signals(*factors, shared.amplitudes.copy()).reshape(residual.shape)
    for signal, one in zip(signals, alone, strict=True):
        np.testing.assert_allclose(signal, synthesize(one.amplitudes, *factors), rtol=1e-12)


def test_cost_of_one_component_changes_as_the_dense_evidence_does(crowded):
    points, precisions, residual = crowded
    others, factors = shared_set(points[1:], precisions[1:], residual)
    columns = as_columns(others, factors)
    ends = np.array([0.1, 0.1]), np.array([0.08, 0.13])
    cost = [shared_cost_jet(*end, precisions[0], residual, columns).value for end in ends]
    dense = [dense_evidence(np.vstack([end, points[1:]]), precisions, residual) for end in ends]
    # Both are sums of logarithms and quadratic forms of a few hundred: rounding of 1e-13 each.
    assert cost[1] - cost[0] == pytest.approx(dense[1] - dense[0], rel=1e-9)


def test_slopes_of_one_component_are_those_of_differences(crowded):
    points, precisions, residual = crowded
    others, factors = shared_set(points[1:], precisions[1:], residual)
    columns = as_columns(others, factors)
    point, step = np.array([0.11, 0.12]), 1e-5

    def jet(move):
        return shared_cost_jet(*(point + move), 0.3, residual, columns)

    middle = jet(np.zeros(2))
    steps = [step * np.eye(2)[i] for i in range(2)]
    values = [(jet(s).value - jet(-s).value) / (2 * step) for s in steps]
    # Second-order differences err by step^2 times the third derivative, (2 pi 16)^2 1e-10 relative.
    np.testing.assert_allclose([middle.by_beat, middle.by_doppler], values, rtol=1e-5)
    bends = [
        (jet(steps[0]).by_beat - jet(-steps[0]).by_beat) / (2 * step),
        (jet(steps[1]).by_beat - jet(-steps[1]).by_beat) / (2 * step),
        (jet(steps[1]).by_doppler - jet(-steps[1]).by_doppler) / (2 * step),
    ]
    found = [middle.by_beat_beat, middle.by_beat_doppler, middle.by_doppler_doppler]
    np.testing.assert_allclose(found, bends, rtol=1e-5)


def test_placing_gives_the_shared_posterior(crowded):
    points, precisions, residual = crowded
    shared, factors = shared_set(points, precisions, residual)
    nothing = factors[0][:0], factors[1][:0]
    placed = place_columns(points, nothing, precisions, flat(residual), NOISE_PRECISION)
    for name in ("gram", "projections", "covariance", "amplitudes"):
        np.testing.assert_allclose(
            getattr(placed, name), getattr(shared, name), rtol=1e-11, atol=1e-14
        )
    assert placed.log_determinant == pytest.approx(shared.log_determinant, rel=1e-12)


def test_climbing_never_lowers_the_cost_and_ends_at_a_peak(crowded):
    points, precisions, residual = crowded
    others, factors = shared_set(points[1:], precisions[1:], residual)
    columns = as_columns(others, factors)
    start = points[0] + [0.4 / SHAPE[1], -0.4 / SHAPE[0]]
    before = shared_cost_jet(*start, 0.0, residual, columns).value
    for steps in (1, 12):
        end = ascend(start, 0.0, split(flat(residual)), columns_as_parts(columns), steps)
        jet = end.end
        assert jet.value >= before
    again = shared_cost_jet(end.beat, end.doppler, 0.0, residual, columns)
    # Compiled on its own the cost rounds otherwise: second derivatives of 1e6 to 1e-14 of that.
    np.testing.assert_allclose(jet, again, rtol=1e-9, atol=1e-6)
    # What is left of the Newton step promises less than the 1e-6 nats at which climbing stops.
    gradient = np.array([jet.by_beat, jet.by_doppler])
    hessian = np.array(
        [[jet.by_beat_beat, jet.by_beat_doppler], [jet.by_beat_doppler, jet.by_doppler_doppler]]
    )
    assert -0.5 * gradient @ np.linalg.solve(hessian, gradient) < 1e-6


def test_precisions_are_the_best_for_the_dense_evidence(crowded):
    points, precisions, residual = crowded
    shared, _ = shared_set(points, precisions, residual)
    for _ in range(60):
        points, precisions, kept, ratios = update_shared(
            points, shared, residual, threshold=NUM_ANTENNAS
        )
        shared, _ = shared_set(points, precisions, residual)
    assert kept.all()
    assert (ratios > NUM_ANTENNAS).all()
    best = dense_evidence(points, precisions, residual)
    for index in range(3):
        for factor in (0.9, 1.1):
            changed = precisions.copy()
            changed[index] *= factor
            assert dense_evidence(points, changed, residual) < best


def test_weak_components_are_pruned_by_the_sum_of_all_antennas(crowded):
    points, precisions, residual = crowded
    shared, _ = shared_set(points, precisions, residual)
    ratios = update_shared(points, shared, residual, threshold=1.0)[3]
    between = float(np.sort(ratios)[:2].mean())
    kept = update_shared(points, shared, residual, threshold=between)[2]
    assert np.flatnonzero(~kept)[0] == np.argmin(ratios)


def test_joint_slopes_are_those_of_differences(crowded):
    points, precisions, residual = crowded
    moved = points + 0.004
    shared, factors = shared_set(moved, precisions, residual)
    gradient, curvature = joint_slopes(3, flat(residual), as_columns(shared, factors))
    step = 1e-6
    for number in range(6):
        move = np.zeros((3, 2))
        move[number % 3, number // 3] = step
        ahead, behind = (shared_set(moved + m, precisions, residual)[0] for m in (move, -move))
        expected = (ahead.cost() - behind.cost()) / (2 * step)
        # Costs of some 1e3 nats round to 1e-13 of that; divided by the step 1e-4, of slopes 1e2 up.
        assert gradient[number] == pytest.approx(expected, rel=1e-4, abs=1e-2)
    assert (np.linalg.eigvalsh(curvature) > 0).all()


def test_bound_of_one_antenna_is_the_usual_one(crowded):
    points, precisions, residual = crowded
    shared, _ = shared_set(points, precisions, residual[:1])
    common = np.diagonal(shared.covariance).real, precisions, shared.log_determinant
    usual = weights_bound(shared.amplitudes[:, 0], *common)
    # An array of one antenna by the formula for several.
    doubled = weights_bound(np.repeat(shared.amplitudes, 2, axis=1), *common)
    assert weights_bound(shared.amplitudes, *common) == pytest.approx(usual, rel=1e-12)
    # A second antenna with the same weights adds its prior and entropy, and q(gamma) = Ga(2, ...):
    # log Gamma(2) - 2 log 2 + 2 stands for twice (0 - 0 + 1) a component.
    assert doubled == pytest.approx(2 * usual - 3 * 2 * np.log(2.0), rel=1e-12)


def test_threshold_of_a_sum_is_exceeded_as_often():
    for threshold in (4.0, 20.0):
        for num_antennas in (2, 4, 8):
            total = threshold_of_sum(threshold, num_antennas)
            # Of the tail exp(-20) the inverse keeps ten digits.
            assert gamma.sf(total, num_antennas) == pytest.approx(np.exp(-threshold), rel=1e-9)


@pytest.mark.parametrize("shape", [(1, 64), (8, 32)])
def test_threshold_grows_with_antennas_less_than_their_energy(shape):
    thresholds = [threshold_from_false_alarm_rate(0.01, *shape, a) for a in (1, 2, 4, 8, 64)]
    assert np.all(np.diff(thresholds) > 0)
    assert np.all(np.diff(np.array(thresholds) / [1, 2, 4, 8, 64]) < 0)
    # So many alarms are asked for that every component is kept that has a prior at all.
    assert threshold_from_false_alarm_rate(1e3, *shape, 4) >= 4.0


@pytest.mark.scenario
@pytest.mark.parametrize("shape", [(1, 128), (8, 32)])
def test_false_alarms_of_four_antennas_are_those_asked_for(shape):
    frames = 150
    found = bench.noise_alarms(4, shape, 0.3, range(frames))
    interval = poisson_interval(found, frames, level=0.999)
    # The number of maxima is approximate: measured 0 to 20 % below what is asked for.
    assert interval.low < 0.3 < interval.high / 0.8


@pytest.mark.scenario
def test_four_antennas_detect_six_decibels_below_one():
    # With 0.05 false alarms asked for, the threshold is 10.6 dB for one antenna and 12.2 dB for the
    # sum of four: 16 and 10 dB are well above, where both miss less than one object of a hundred.
    hits = bench.detections(1, 16.0, -20.0, range(25)), bench.detections(4, 10.0, -20.0, range(25))
    assert min(hits) >= 24
    # 10 dB is below the threshold of one antenna: 5 % of the objects exceed it.
    alone = bench.detections(1, 10.0, -20.0, range(25))
    assert binomial_interval(alone, 25, level=0.999).high < 0.95


@pytest.mark.scenario
def test_four_antennas_attain_the_bounds_under_interference():
    runs = [
        bench.separated("simulation-1", 4, snr_db=24.0, sir_db=-20.0, seed=s) for s in range(40)
    ]
    assert all(each.hits.all() for each in runs)
    # The variance of 40 normal errors scatters by sqrt(2/40) = 22 %: four times that.
    for kind in ("beat_errors", "angle_errors"):
        errors = np.concatenate([getattr(each, kind) for each in runs])
        assert 0.1 < np.mean(errors**2) < 1.9


@pytest.mark.scenario
def test_bursts_have_one_place_at_all_antennas():
    drawn, _, observation = bench.antenna_frame(
        "simulation-2-a", 3, snr_db=55.0, sir_db=-20.0, seed=1
    )
    model = SignalModel.of_radar(drawn.radar, drawn.anti_aliasing_filter, 3)
    state = run(make_estimator("factorised", model), observation.received).state
    true_ramps = sorted({burst.ramp for burst in observation.truth.bursts})
    places = {}
    for burst in state.bursts:
        places.setdefault(burst.ramp, []).append(
            (burst.antenna, burst.start_frequency, burst.slope)
        )
    assert sorted(places) == true_ramps == list(state.interfered_ramps)
    for every in places.values():
        assert [antenna for antenna, _, _ in every] == [0, 1, 2]
        assert len({place for _, *place in map(tuple, every) for place in [tuple(place)]}) == 1
    left = observation.received.reshape(state.object_signal.shape)
    left = left - state.object_signal - state.interference_signal
    # Noise power of 3 * 16 * 128 samples scatters by 1.3 %; some 100 weights explain 1 % of it.
    power = np.mean(np.abs(left) ** 2) * observation.truth.noise_precision
    assert power == pytest.approx(1.0, abs=0.08)


def test_a_burst_that_one_antenna_does_not_receive_is_found_by_the_others():
    drawn, _, observation = bench.antenna_frame(
        "simulation-2-a", 2, snr_db=55.0, sir_db=-20.0, seed=1
    )
    received = observation.received.copy()
    received[1] -= observation.truth.interference_signal[1]
    model = SignalModel.of_radar(drawn.radar, drawn.anti_aliasing_filter, 2)
    state = run(make_estimator("factorised", model), received).state
    energy = np.zeros(2)
    for burst in state.bursts:
        energy[burst.antenna] += burst.energy
    true_ramps = {burst.ramp for burst in observation.truth.bursts}
    assert {burst.ramp for burst in state.bursts if burst.antenna == 0} == true_ramps
    assert energy[1] < 1e-3 * energy[0]


def test_object_only_takes_several_antennas():
    drawn, _, observation = bench.antenna_frame(
        "simulation-2-a", 2, snr_db=60.0, sir_db=0.0, seed=2, interference=False
    )
    model = SignalModel.of_radar(drawn.radar, drawn.anti_aliasing_filter, 2)
    solution = run(make_estimator("object-only", model), observation.received)
    assert solution.objects.amplitudes.shape == (solution.objects.num_components, 2)
    # The strongest object is found with its component SNR, which is the mean of the antennas.
    power = np.mean(np.abs(observation.truth.amplitudes) ** 2, axis=1)
    best = float(power.max() * observation.truth.noise_precision)
    assert solution.objects.component_snr.max() == pytest.approx(best, rel=0.1)


@pytest.mark.parametrize("name", ["joint", "masked"])
def test_other_estimators_take_one_antenna(name, small_radar):
    model = SignalModel.of_radar(small_radar, NoFilter(), 2)
    with pytest.raises(InputError, match=f"{name} estimator is given 2 antennas; it takes 1"):
        make_estimator(name, model)


def test_a_frame_of_other_antennas_is_refused(small_radar):
    model = SignalModel.of_radar(small_radar, NoFilter(), 3)
    with pytest.raises(InputError, match=r"shape \(2, 4, 32\); it must be \(3, 4, 32\)"):
        model.check(np.ones((2, 4, 32)))
    assert model.check(np.ones((3, 4, 32))).shape == (12, 32)
