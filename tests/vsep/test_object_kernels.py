"""The kernels of the objects against dense formulas."""

import numpy as np
import pytest

from vsep.kernels.candidates import best_candidate, candidate_peaks, grid_power, next_peak
from vsep.kernels.complex_parts import ComplexParts, line_moments, split
from vsep.kernels.convergence import largest_change
from vsep.kernels.joint_slopes import joint_slopes
from vsep.kernels.line_spectra import Columns, columns_as_parts, fill_line
from vsep.kernels.newton_ascent import downdate, refine_line, update_inverse
from vsep.kernels.object_cost import atom_fit, cost_jet
from vsep.kernels.object_posterior import (
    lines_trace,
    object_signals,
    place_columns,
    subtract_columns,
)

SHAPE = (5, 24)
NUM_ANTENNAS = 2
NOISE_PRECISION = 3.0
POINTS = np.array([[0.1, 0.2], [0.13, 0.15], [-0.31, -0.43]])
PRECISIONS = np.array([0.3, 0.2, 0.5])


def drawn(*shape):
    rng = np.random.default_rng(shape)
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def whole(parts):
    return parts.real + 1j * parts.imag


def dense_line(frequency, size):
    return np.exp(-2j * np.pi * frequency * np.arange(size)) / np.sqrt(size)


def dense_factors(points):
    beat = np.array([dense_line(f, SHAPE[1]) for f in points[:, 0]])
    return beat, np.array([dense_line(f, SHAPE[0]) for f in points[:, 1]])


def dense_atoms(points):
    """(P N, L) atoms, written out."""
    return np.array([np.kron(d, b) for b, d in zip(*dense_factors(points), strict=True)]).T


@pytest.fixture(scope="module")
def posterior():
    """Residual (A P, N), and the columns with their dense posterior."""
    residual = 2.0 * drawn(NUM_ANTENNAS * SHAPE[0], SHAPE[1])
    return residual, dense_columns(POINTS, PRECISIONS, residual)


def dense_columns(points, precisions, residual):
    atoms, frames = dense_atoms(points), residual.reshape(NUM_ANTENNAS, -1)
    covariance = np.linalg.inv(NOISE_PRECISION * atoms.conj().T @ atoms + np.diag(precisions))
    amplitudes = NOISE_PRECISION * covariance @ atoms.conj().T @ frames.T
    return Columns(*dense_factors(points), covariance, amplitudes, NOISE_PRECISION)


@pytest.mark.parametrize("size", [1, 3, 16, 100, 1000])
@pytest.mark.parametrize("frequency", [0.0, 0.123, -0.4999, 7.25])
def test_lines_are_exponentials(size, frequency):
    line = ComplexParts(np.empty(size), np.empty(size))
    fill_line(frequency, line)
    # A phase of `frequency * size` cycles is known to that many roundings.
    error = 2e-15 * max(1.0, abs(frequency) * size)
    np.testing.assert_allclose(
        whole(line) * np.sqrt(size), dense_line(frequency, size) * np.sqrt(size), atol=error * 7
    )


def test_moments_are_inner_products_with_the_derivatives_of_a_line():
    signals, line, size = drawn(4, 24), drawn(24), 24
    moments = ComplexParts(np.empty((3, 4)), np.empty((3, 4)))
    line_moments(split(signals), ComplexParts(line.real.copy(), line.imag.copy()), moments)
    turns = -2j * np.pi * (np.arange(size) - 0.5 * (size - 1))
    expected = [signals @ (turns**order * line).conj() for order in range(3)]
    np.testing.assert_allclose(whole(moments), expected, rtol=1e-12)


def test_placing_equals_dense_algebra(posterior):
    residual, columns = posterior
    nothing = columns.beat_factors[:0], columns.doppler_factors[:0]
    placed = place_columns(POINTS, nothing, PRECISIONS, residual, NOISE_PRECISION)
    atoms = dense_atoms(POINTS)
    np.testing.assert_allclose(placed.gram, atoms.conj().T @ atoms, atol=1e-14)
    np.testing.assert_allclose(placed.covariance, columns.covariance, rtol=1e-11)
    np.testing.assert_allclose(placed.amplitudes, columns.amplitudes, rtol=1e-11)
    determinant = np.linalg.slogdet(columns.covariance)[1]
    assert placed.log_determinant == pytest.approx(determinant, rel=1e-12)
    expected = np.trace(atoms @ columns.covariance @ atoms.conj().T).real
    trace = lines_trace(POINTS.T.copy(), columns.covariance, *SHAPE)
    assert trace == pytest.approx(expected, rel=1e-12)


def test_a_matrix_that_is_not_positive_has_no_determinant(posterior):
    residual, columns = posterior
    nothing = columns.beat_factors[:0], columns.doppler_factors[:0]
    placed = place_columns(POINTS, nothing, -2.0 * PRECISIONS - 3.0, residual, NOISE_PRECISION)
    assert np.isnan(placed.log_determinant)


def test_signals_are_those_of_dense_atoms(posterior):
    residual, columns = posterior
    atoms = dense_atoms(POINTS)
    signals = object_signals(*columns[:2], columns.amplitudes)
    frames = (atoms @ columns.amplitudes).T.reshape(residual.shape)
    np.testing.assert_allclose(signals, frames, atol=1e-13)
    rest = subtract_columns(residual, columns)
    assert rest.dtype == np.complex64
    # Single precision rounds values of up to ten to 1e-6.
    np.testing.assert_allclose(rest.reshape(residual.shape), residual - frames, atol=2e-6)


def test_the_fit_of_an_atom_is_its_cost_without_derivatives(posterior):
    residual, columns = posterior
    jet = cost_jet(0.11, 0.18, 0.4, split(residual), columns_as_parts(columns))
    fit = atom_fit(0.11, 0.18, 0.4, split(residual), columns_as_parts(columns))
    np.testing.assert_allclose(fit, (jet.value, jet.inverse_rho, jet.power), rtol=1e-11)


def test_a_component_is_taken_out_and_put_in_as_in_dense_algebra(posterior):
    residual, columns = posterior
    parts, others = columns_as_parts(columns), [0, 2]
    downdate(parts, 1)
    without = dense_columns(POINTS[others], PRECISIONS[others], residual)
    covariance, amplitudes = whole(parts.covariance), whole(parts.amplitudes)
    np.testing.assert_allclose(
        covariance[np.ix_(others, others)], without.covariance, rtol=1e-11, atol=1e-14
    )
    np.testing.assert_allclose(amplitudes[others], without.amplitudes, rtol=1e-11)
    assert not covariance[1].any()
    assert not amplitudes[1].any()
    moved, precisions = POINTS.copy(), PRECISIONS.copy()
    moved[1], precisions[1] = (0.14, 0.11), 0.7
    fit = atom_fit(0.14, 0.11, 0.7, split(residual), parts)
    update_inverse(parts, 1, 0.7, fit.inverse_rho)
    again = dense_columns(moved, precisions, residual)
    np.testing.assert_allclose(whole(parts.covariance), again.covariance, rtol=1e-11)
    np.testing.assert_allclose(whole(parts.amplitudes), again.amplitudes, rtol=1e-10)
    np.testing.assert_allclose(whole(parts.beat_factors), again.beat_factors, atol=1e-14)
    np.testing.assert_allclose(whole(parts.doppler_factors), again.doppler_factors, atol=1e-14)


def test_a_move_never_lowers_the_cost(posterior):
    residual, columns = posterior
    rest, parts = split(residual), columns_as_parts(columns)
    for start in np.random.default_rng(2).uniform(-0.5, 0.5, (40, 2)):
        point = start.copy()
        fit = refine_line(point, 0.3, rest, parts)
        before = cost_jet(*start, 0.3, rest, parts).value
        # Where nothing is gained the two costs are the same to rounding.
        assert fit.value >= before - 1e-12 * abs(before)
        assert fit.value == pytest.approx(cost_jet(*point, 0.3, rest, parts).value, rel=1e-11)


def test_joint_curvature_is_the_fisher_information_of_dense_atoms(posterior):
    residual, columns = posterior
    gradient, curvature = joint_slopes(3, residual, columns)
    ramps, samples = np.mgrid[: SHAPE[0], : SHAPE[1]]
    turns = [-2j * np.pi * (axis - axis.mean()).ravel() for axis in (samples, ramps)]
    atoms = dense_atoms(POINTS)
    moved = np.hstack([turn[:, None] * atoms for turn in turns])
    weights = np.vstack([columns.amplitudes] * 2)
    hidden = atoms @ columns.covariance @ atoms.conj().T
    seen = moved.conj().T @ (np.eye(len(atoms)) - NOISE_PRECISION * hidden) @ moved
    expected = 2.0 * NOISE_PRECISION * (weights.conj() @ weights.T * seen).real
    np.testing.assert_allclose(curvature, expected, rtol=1e-9, atol=1e-9 * abs(expected).max())
    assert gradient.shape == (6,)


def test_peaks_are_the_highest_values_apart_from_each_other():
    grid = drawn(NUM_ANTENNAS, 10, 48).astype(np.complex64)
    power = grid_power(grid)
    np.testing.assert_allclose(power, np.sum(np.abs(grid) ** 2, axis=0), rtol=1e-6)
    highest, left = np.argmax(power, axis=1), power.copy()
    for _ in range(6):
        row, column = next_peak(power, highest)
        assert (row, column) == np.unravel_index(np.argmax(left), left.shape)
        around = np.ix_(np.arange(row - 2, row + 3) % 10, np.arange(column - 2, column + 3) % 48)
        left[around] = 0.0
        np.testing.assert_array_equal(power, left)


def test_a_strong_line_is_the_best_candidate(posterior):
    residual, _ = posterior
    point = np.array([[0.31, -0.22]])
    strong = residual + object_signals(*dense_factors(point), np.full((1, NUM_ANTENNAS), 60.0 + 0j))
    columns = dense_columns(POINTS, PRECISIONS, strong)
    size = 2 * SHAPE[0], 2 * SHAPE[1]
    grid = np.fft.ifft2(subtract_columns(strong, columns), s=size).astype(np.complex64)
    peaks = candidate_peaks(grid, columns, np.ones(1))
    found = best_candidate(peaks, strong, columns, 10.0, np.ones(1))
    # The root bound at an amplitude of 60 in noise of 2.8 is below a hundredth of a cell.
    assert abs(found.beat - 0.31) < 0.02 / SHAPE[1]
    assert abs(found.doppler + 0.22) < 0.02 / SHAPE[0]
    assert not found.absorbed
    # Against the dense moments of the atom beside the others, (23)-(24) with no prior of its own.
    atom = dense_atoms(np.array([[found.beat, found.doppler]]))[:, 0]
    atoms, frames = dense_atoms(POINTS), strong.reshape(NUM_ANTENNAS, -1)
    overlap = atoms.conj().T @ atom
    inverse_rho = NOISE_PRECISION
    inverse_rho -= NOISE_PRECISION**2 * (overlap.conj() @ columns.covariance @ overlap).real
    rest = frames - (atoms @ columns.amplitudes).T
    ratio = np.sum(np.abs(NOISE_PRECISION * (rest @ atom.conj())) ** 2) / inverse_rho
    assert found.ratio == pytest.approx(ratio, rel=1e-9)
    precision = 1.0 / (ratio / NUM_ANTENNAS / inverse_rho - 1.0 / inverse_rho)
    assert found.precision == pytest.approx(precision, rel=1e-9)


def test_moves_are_counted_in_deviations(posterior):
    _, columns = posterior
    before = POINTS.copy()
    before[1] += [1.0 + 0.02, 0.0]  # frequencies are cyclic
    variance = columns.covariance[1, 1].real
    power = np.sum(np.abs(columns.amplitudes[1]) ** 2)
    ratio = max(power / variance**2 / (1.0 / variance - PRECISIONS[1]), 1.0)
    expected = 0.02 * SHAPE[1] * 2.0 * np.pi / np.sqrt(6.0 / ratio)
    found = largest_change(before, POINTS, PRECISIONS, columns)
    assert found == pytest.approx(expected, rel=1e-9)
