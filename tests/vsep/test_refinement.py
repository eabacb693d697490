"""The costs (70) and (67) against their dense definitions and finite differences."""

import numpy as np
import pytest

from vsep.inference.objects.refinement import joint_slopes, joint_step, place_components
from vsep.inference.objects.sbl import ActiveSet
from vsep.inference.objects.workspace import no_background
from vsep.kernels import newton_ascent, object_cost
from vsep.kernels.complex_parts import split
from vsep.kernels.line_spectra import Columns, columns_as_parts
from vsep.kernels.newton_ascent import NO_GAIN
from vsep.signal.atoms import gram, line_factors, project, synthesize

SHAPE = (6, 20)
NOISE_PRECISION = 50.0


def atom(point):
    doppler = np.exp(-2j * np.pi * point[1] * np.arange(SHAPE[0]))
    beat = np.exp(-2j * np.pi * point[0] * np.arange(SHAPE[1]))
    return np.kron(doppler, beat) / np.sqrt(SHAPE[0] * SHAPE[1])


@pytest.fixture
def crowded():
    """A residual with three modelled components and one that is to be placed."""
    rng = np.random.default_rng(11)
    beats, dopplers = np.array([0.1, 0.14, -0.3]), np.array([0.2, 0.05, -0.1])
    factors = line_factors(beats, SHAPE[1]), line_factors(dopplers, SHAPE[0])
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    residual = synthesize(np.array([2.0, 1.5j, 1.0 + 0j]), *factors)
    residual = residual + 1.2 * atom((0.125, 0.12)).reshape(SHAPE) + 0.05 * noise
    others = ActiveSet(
        gram(*factors), project(residual, *factors), np.array([0.2, 0.4, 0.9]), NOISE_PRECISION
    )
    return residual, others, factors


def as_columns(others, factors):
    """The other components as the kernels take them."""
    amplitudes = others.amplitudes[:, None]
    return columns_as_parts(Columns(*factors, others.covariance, amplitudes, NOISE_PRECISION))


def cost_jet(point, precision, residual, others, factors):
    return object_cost.cost_jet(*point, precision, split(residual), as_columns(others, factors))


def refine_point(point, precision, residual, others, factors, max_steps):
    columns = as_columns(others, factors)
    end = newton_ascent.ascend(point, precision, split(residual), columns, max_steps)
    return np.array([end.beat, end.doppler])


def slopes(jet):
    """Gradient (2,) and Hessian (2, 2) of a cost."""
    mixed = jet.by_beat_doppler
    hessian = [[jet.by_beat_beat, mixed], [mixed, jet.by_doppler_doppler]]
    return np.array([jet.by_beat, jet.by_doppler]), np.array(hessian)


def dense_cost(point, precision, residual, factors, precisions):
    """log|C| + lambda^2 r^H Phi C Phi^H r of (67) with the component at `point` placed last."""
    atoms = np.stack([np.kron(d, b) for b, d in zip(*factors, strict=True)] + [atom(point)], axis=1)
    everything = np.append(precisions, precision)
    covariance = np.linalg.inv(NOISE_PRECISION * atoms.conj().T @ atoms + np.diag(everything))
    projected = atoms.conj().T @ residual.ravel()
    fit = NOISE_PRECISION**2 * (projected.conj() @ covariance @ projected).real
    return np.linalg.slogdet(covariance)[1] + fit


@pytest.mark.parametrize("precision", [0.0, 0.7])
def test_single_component_cost_is_the_joint_cost_up_to_a_constant(crowded, precision):
    residual, others, factors = crowded
    first, second = np.array([0.12, 0.11]), np.array([-0.02, 0.4])
    fast = [cost_jet(p, precision, residual, others, factors).value for p in (first, second)]
    dense = [
        dense_cost(p, precision, residual, factors, others.precisions) for p in (first, second)
    ]
    assert fast[1] - fast[0] == pytest.approx(dense[1] - dense[0], rel=1e-10)


def test_gradient_and_hessian_equal_finite_differences(crowded):
    residual, others, factors = crowded
    point, precision = np.array([0.118, 0.13]), 0.3
    gradient, hessian = slopes(cost_jet(point, precision, residual, others, factors))
    step = 1e-5
    for axis in range(2):
        shift = np.eye(2)[axis] * step
        ahead = cost_jet(point + shift, precision, residual, others, factors)
        behind = cost_jet(point - shift, precision, residual, others, factors)
        # Central differences err by step^2/6 times the third derivative: here below 1e-5.
        slope = (ahead.value - behind.value) / (2 * step)
        assert gradient[axis] == pytest.approx(slope, rel=1e-5)
        curvature = (slopes(ahead)[0] - slopes(behind)[0]) / (2 * step)
        np.testing.assert_allclose(hessian[axis], curvature, rtol=1e-5)


def test_refinement_never_lowers_the_cost(crowded):
    residual, others, factors = crowded
    rng = np.random.default_rng(5)
    for start in rng.uniform(-0.5, 0.5, (40, 2)):
        end = refine_point(start, 0.2, residual, others, factors, max_steps=3)
        before = cost_jet(start, 0.2, residual, others, factors).value
        assert cost_jet(end, 0.2, residual, others, factors).value >= before


def test_refinement_reaches_the_top_of_the_cost(crowded):
    residual, others, factors = crowded
    end = refine_point(np.array([0.12, 0.1]), 0.0, residual, others, factors, max_steps=20)
    jet = cost_jet(end, 0.0, residual, others, factors)
    # It stops where a Newton step promises less than NO_GAIN: half of g^T (-H)^-1 g.
    gradient, hessian = slopes(jet)
    assert gradient @ np.linalg.solve(-hessian, gradient) < 2.0 * NO_GAIN


@pytest.mark.parametrize("num_background", [0, 2])
@pytest.mark.parametrize("num_ramps", [1, 6])
def test_joint_gradient_equals_finite_differences(crowded, num_ramps, num_background):
    rng = np.random.default_rng(3)
    background = (
        rng.standard_normal((num_background, SHAPE[1])) + 0.5j,
        rng.standard_normal((num_background, num_ramps)) - 0.2j,
    )
    residual = crowded[0][:num_ramps]
    points = np.array([[0.1, 0.2], [0.14, 0.05], [-0.3, -0.1]])
    points[:, 1] *= num_ramps > 1
    precisions = np.array([0.2, 0.4, 0.9, 0.3, 0.8])[: 3 + num_background]

    def place(shifted):
        return place_components(shifted, precisions, residual, NOISE_PRECISION, background)

    def cost(shifted):
        return place(shifted).active.cost()

    placed = place(points)
    gradient, _ = joint_slopes(placed, residual)
    step = 1e-6
    for row in range(len(gradient)):
        shift = np.zeros((3, 2))
        shift[row % 3, row // 3] = step
        difference = (cost(points + shift) - cost(points - shift)) / (2 * step)
        # Rounding of a cost near 300 over the step: 1e-7 absolute on slopes of 1e2 to 1e4.
        assert gradient[row] == pytest.approx(difference, rel=1e-5, abs=1e-4)


def test_joint_step_climbs_where_two_share_a_cell():
    factors = (
        line_factors(np.array([0.1, 0.13]), SHAPE[1]),
        line_factors(np.array([0.1, 0.12]), SHAPE[0]),
    )
    rng = np.random.default_rng(7)
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    residual = synthesize(np.array([3.0 + 0j, 2.5j]), *factors) + 1e-3 * noise
    points = np.array([[0.105, 0.11], [0.128, 0.11]])
    nothing = no_background(*SHAPE).factors
    placed = place_components(points, np.array([0.1, 0.1]), residual, NOISE_PRECISION, nothing)
    for _ in range(12):
        moved = joint_step(placed, residual)
        assert moved.active.cost() >= placed.active.cost()
        placed = moved
    gradient, curvature = joint_slopes(placed, residual)
    assert gradient @ np.linalg.solve(curvature, gradient) < 2.0 * NO_GAIN
