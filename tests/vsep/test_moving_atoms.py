"""Moving objects: kernels against dense formulas, exact delays and finite differences."""

import numpy as np
import pytest

from vsep.inference.objects.refinement import joint_slopes, place_components
from vsep.inference.objects.uncertainty import fisher_information
from vsep.kernels.candidates import best_candidate, candidate_peaks
from vsep.kernels.complex_parts import empty_rows, split
from vsep.kernels.doppler_intervals import unfold_lines
from vsep.kernels.line_spectra import columns_as_parts
from vsep.kernels.moving_atoms import (
    Migration,
    fold_loss,
    fold_width,
    frame_products,
    moving_jets,
    moving_products,
    moving_signals,
    ramp_sums,
)
from vsep.kernels.newton_ascent import downdate, update_inverse
from vsep.kernels.object_cost import atom_fit, cost_jet
from vsep.kernels.object_posterior import subtract_columns
from vsep.signal.atoms import dense_atoms, doppler_course
from vsep.signal.keystone import keystone_dopplers, keystone_transform
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

SHAPE = (6, 24)
NUM_ANTENNAS = 2
NOISE_PRECISION = 3.0
MIGRATION = Migration(0.011, 0.03, 1)
WIDTH = fold_width(MIGRATION, SHAPE[1])
# Close, far, a Doppler interval apart, and nearly one
POINTS = np.array(
    [[0.1, 0.2], [0.13, 0.15], [-0.31, 1.4], [0.1, 0.2 + WIDTH], [0.1, 0.2004 - WIDTH]]
)
PRECISIONS = np.array([0.3, 0.2, 0.5, 0.4, 0.6])


def drawn(*shape):
    rng = np.random.default_rng(shape)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def whole(parts):
    return parts.real + 1j * parts.imag


def atoms_at(points):
    """(P N, L) atoms, written out."""
    return dense_atoms(*np.array(points).T, SHAPE, MIGRATION).reshape(len(points), -1).T


def turns():
    """What a derivative by beat and by Doppler frequency multiplies an atom with, (2, P N)."""
    samples = np.broadcast_to(np.arange(SHAPE[1]) - 0.5 * (SHAPE[1] - 1), SHAPE)
    course = doppler_course(SHAPE, MIGRATION) - 0.5 * (SHAPE[0] - 1)
    return -2j * np.pi * np.array([samples, course]).reshape(2, -1)


def dense_jet(point, signals):
    """(6, ...) inner products of an atom and its derivatives with columns (P N, ...)."""
    beat, doppler = turns()
    atom = atoms_at([point])[:, 0]
    factors = (1.0, beat, doppler, beat * beat, beat * doppler, doppler * doppler)
    return np.array([(factor * atom).conj() @ signals for factor in factors])


@pytest.fixture(scope="module")
def placed():
    """Residual (A P, N) and the posterior of all columns."""
    residual = 2.0 * drawn(NUM_ANTENNAS * SHAPE[0], SHAPE[1])
    return residual, place(POINTS, residual)


def place(points, residual, precisions=PRECISIONS):
    nothing = np.zeros((0, SHAPE[1]), complex), np.zeros((0, SHAPE[0]), complex)
    precisions = precisions[: len(points)]
    return place_components(points, precisions, residual, NOISE_PRECISION, nothing, MIGRATION)


def test_phases_are_those_of_exact_delays():
    radar = ChirpSequence(
        start_frequency_hz=77e9,
        slope_hz_per_s=3e13,
        sample_rate_hz=1e7,
        ramp_period_s=60e-6,
        num_samples=256,
        num_ramps=64,
        range_migration=True,
    )
    # The radar's carrier after n samples times the delay then; 20 m and 30 m/s at mid-frame.
    times = radar.ramp_times_s[:, None] + radar.sample_times_s
    distance_m = 20.0 + 30.0 * (times - times.mean())
    carrier_hz = radar.start_frequency_hz + radar.slope_hz_per_s * radar.sample_times_s
    exact = np.exp(-2j * np.pi * carrier_hz * distance_m * 2.0 / SPEED_OF_LIGHT_MPS)
    beat = radar.beat_from_delay(np.array([40.0 / SPEED_OF_LIGHT_MPS]))
    doppler = radar.doppler_from_hz(np.array([60.0 / SPEED_OF_LIGHT_MPS * 77e9]))
    atom = dense_atoms(beat, doppler, radar.shape, radar.migration)[0]
    # All that differs is a constant phase; 1e7 cycles are known to 1e-9.
    assert abs(np.vdot(atom, exact)) == pytest.approx(np.linalg.norm(exact), rel=1e-12)
    assert radar.velocity_from_doppler(doppler)[0] == pytest.approx(30.0, rel=1e-12)
    assert radar.range_from_beat(beat)[0] == pytest.approx(20.0, rel=1e-12)


@pytest.mark.parametrize("num_ramps", [2, 5, 6, 64])
def test_sums_over_the_ramps_hold_near_every_period(num_ramps):
    ramps = np.arange(num_ramps) - 0.5 * (num_ramps - 1)
    for offset in (0.0, 1e-9, 1e-4 / num_ramps, 0.0158 / num_ramps, 0.0161 / num_ramps, 0.37):
        for theta in (offset, 1.0 - offset, -2.0 + offset):
            angle = 2.0 * np.pi * theta * ramps
            dense = np.cos(angle), ramps * np.sin(angle), ramps**2 * np.cos(angle)
            sizes = num_ramps, num_ramps**2, num_ramps**3
            for found, true, size in zip(ramp_sums(theta, num_ramps), dense, sizes, strict=True):
                assert abs(found - true.sum()) < 1e-11 * size


def test_inner_products_are_those_of_dense_atoms():
    atoms = atoms_at(POINTS)
    expected = np.array([dense_jet(point, atoms) for point in POINTS]).transpose(1, 0, 2)
    jets = moving_jets(POINTS, MIGRATION, *SHAPE, 6)
    for found, true in zip(jets, expected, strict=True):
        np.testing.assert_allclose(found, true, atol=1e-11 * abs(true).max())
    np.testing.assert_array_equal(moving_jets(POINTS, MIGRATION, *SHAPE, 1)[0], jets[0])


def test_products_with_frames_and_signals_are_those_of_dense_atoms():
    signals, atoms = drawn(NUM_ANTENNAS * SHAPE[0], SHAPE[1]), atoms_at(POINTS)
    frames = signals.reshape(NUM_ANTENNAS, -1).T
    courses, products = empty_rows(3 * NUM_ANTENNAS + 2, SHAPE[1]), empty_rows(6, NUM_ANTENNAS)
    for point in POINTS:
        frame_products(tuple(point), MIGRATION, SHAPE[0], split(signals), courses, products, 6)
        expected = dense_jet(point, frames)
        np.testing.assert_allclose(whole(products), expected, rtol=1e-11, atol=1e-11)
    found = moving_products(POINTS, MIGRATION, SHAPE[0], signals)
    np.testing.assert_allclose(found, atoms.conj().T @ frames, atol=1e-12)
    weights = drawn(len(POINTS), NUM_ANTENNAS)
    made = moving_signals(POINTS, weights, MIGRATION, *SHAPE)
    np.testing.assert_allclose(made, (atoms @ weights).T.reshape(signals.shape), atol=1e-12)


def test_the_grid_of_candidates_holds_inner_products():
    signals = drawn(NUM_ANTENNAS, *SHAPE).astype(np.complex64)
    grid = keystone_transform(signals, MIGRATION)
    num_rows = 2 * SHAPE[0] * (2 * MIGRATION.folds + 1)
    assert grid.shape == (NUM_ANTENNAS, num_rows, 2 * SHAPE[1])
    dopplers = keystone_dopplers(SHAPE, MIGRATION)
    assert dopplers[num_rows // 2] == 0.0
    beats = np.arange(2 * SHAPE[1]) / (2 * SHAPE[1])
    points = np.array([[b, d] for d in dopplers for b in beats])
    expected = atoms_at(points).conj().T @ signals.reshape(NUM_ANTENNAS, -1).T
    found = abs(grid).reshape(NUM_ANTENNAS, -1).T
    # Single precision
    np.testing.assert_allclose(found, abs(expected), atol=1e-5)


def test_the_cost_has_the_slopes_of_finite_differences(placed):
    residual, columns = placed
    rest, parts = split(residual), columns_as_parts(columns.columns)
    downdate(parts, 1)

    def jet_at(point):
        return cost_jet(point[0], point[1], 0.4, rest, parts)

    point, step = np.array([0.118, 0.17]), 1e-5
    jet = jet_at(point)
    hessian = [
        [jet.by_beat_beat, jet.by_beat_doppler],
        [jet.by_beat_doppler, jet.by_doppler_doppler],
    ]
    for axis in range(2):
        ahead, behind = (jet_at(point + side * step * np.eye(2)[axis]) for side in (1, -1))
        slope = (ahead.value - behind.value) / (2 * step)
        assert (jet.by_beat, jet.by_doppler)[axis] == pytest.approx(slope, rel=1e-5)
        bends = np.subtract(ahead[1:3], behind[1:3]) / (2 * step)
        np.testing.assert_allclose(hessian[axis], bends, rtol=1e-4)
    fit = atom_fit(*point, 0.4, rest, parts)
    np.testing.assert_allclose(fit, (jet.value, jet.inverse_rho, jet.power), rtol=1e-11)


def test_a_component_is_taken_out_and_put_in_as_in_dense_algebra(placed):
    residual, columns = placed
    parts = columns_as_parts(columns.columns)
    downdate(parts, 1)
    moved, precisions = POINTS.copy(), PRECISIONS.copy()
    moved[1], precisions[1] = (0.14, 0.11), 0.7
    fit = atom_fit(0.14, 0.11, 0.7, split(residual), parts)
    update_inverse(parts, 1, 0.7, fit.inverse_rho)
    atoms, frames = atoms_at(moved), residual.reshape(NUM_ANTENNAS, -1).T
    covariance = np.linalg.inv(NOISE_PRECISION * atoms.conj().T @ atoms + np.diag(precisions))
    np.testing.assert_allclose(whole(parts.covariance), covariance, rtol=1e-10, atol=1e-12)
    weights = NOISE_PRECISION * covariance @ atoms.conj().T @ frames
    np.testing.assert_allclose(whole(parts.amplitudes), weights, rtol=1e-9, atol=1e-11)
    np.testing.assert_array_equal(parts.points, moved)


def test_the_joint_slopes_are_those_of_the_joint_cost(placed):
    residual, columns = placed
    gradient, curvature = joint_slopes(columns, residual)
    step = 1e-6
    for index, found in enumerate(gradient):
        costs = []
        for side in (1, -1):
            shifted = POINTS.copy()
            shifted[index % len(POINTS), index // len(POINTS)] += side * step
            costs.append(place(shifted, residual).active.cost())
        slope = (costs[0] - costs[1]) / (2 * step)
        assert found == pytest.approx(slope, rel=1e-4, abs=1e-3)
    atoms, weights = atoms_at(POINTS), columns.active.amplitudes
    moved = np.hstack([turn[:, None] * atoms for turn in turns()])
    hidden = atoms @ columns.active.covariance @ atoms.conj().T
    seen = moved.conj().T @ (np.eye(len(atoms)) - NOISE_PRECISION * hidden) @ moved
    pairs = np.vstack([weights] * 2)
    expected = 2.0 * NOISE_PRECISION * (pairs.conj() @ pairs.T * seen).real
    np.testing.assert_allclose(curvature, expected, atol=1e-9 * abs(expected).max())
    points, precision = POINTS.T, PRECISIONS
    fisher = fisher_information(*points, weights, precision, NOISE_PRECISION, SHAPE, MIGRATION)
    np.testing.assert_allclose(fisher, expected, atol=1e-9 * abs(expected).max())


@pytest.mark.parametrize("doppler", [0.22, 0.9, -1.1])
def test_a_strong_object_is_found_in_its_own_interval_of_doppler_frequency(doppler):
    residual = 0.5 * drawn(NUM_ANTENNAS * SHAPE[0], SHAPE[1])
    truth = np.array([[0.31, doppler]])
    weights = np.full((1, NUM_ANTENNAS), 40.0 + 0j)
    strong = residual + moving_signals(truth, weights, MIGRATION, *SHAPE)
    columns = place(POINTS, strong).columns
    grid = keystone_transform(subtract_columns(strong, columns), MIGRATION)
    peaks = candidate_peaks(grid, columns, np.ones(1))
    found = best_candidate(peaks, strong, columns, 10.0, np.ones(1))
    assert abs(found.beat - 0.31) < 0.02 / SHAPE[1]
    assert abs(found.doppler - doppler) < 0.02 / SHAPE[0]


def test_objects_in_a_wrong_interval_move_to_their_own():
    truth = np.array([[0.31, 0.22], [-0.12, 1.3]])
    weights = np.full((2, NUM_ANTENNAS), 40.0 + 0j)
    strong = moving_signals(truth, weights, MIGRATION, *SHAPE)
    shift = np.array([-MIGRATION.ramp_share, WIDTH])
    loss = fold_loss(MIGRATION, *SHAPE)
    overlap = np.vdot(*atoms_at([truth[0] + shift, truth[0]]).T)
    assert loss == pytest.approx(1.0 / abs(overlap) ** 2 - 1.0, rel=1e-9)
    for sides in ([1, 0], [-1, 0], [0, -1], [0, 0]):
        placed = place(truth + np.array(sides)[:, None] * shift, strong)
        precisions = placed.active.precisions
        found = unfold_lines(placed.points, precisions, strong, placed.columns)
        np.testing.assert_allclose(found, truth, atol=1e-12)
    # Noise gains a little here and there, which is not enough.
    noise = drawn(NUM_ANTENNAS * SHAPE[0], SHAPE[1]) / np.sqrt(2.0 * NOISE_PRECISION)
    placed = place(truth, noise)
    found = unfold_lines(truth, placed.active.precisions, noise, placed.columns)
    np.testing.assert_array_equal(found, truth)
