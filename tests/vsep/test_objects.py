"""Algorithm 3: the cost (70) against its dense definition and finite differences."""

import numpy as np
import pytest

from vsep.inference.objects import ObjectWorkspace, cost_jet, no_objects, refine_point
from vsep.inference.sbl import ActiveSet
from vsep.inference.state import EventKind
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


def dense_cost(point, precision, residual, factors, precisions):
    """log|C| + lambda^2 r^H Phi C Phi^H r of (67) with the component at `point` placed last."""
    atoms = np.stack(
        [np.kron(d, b) for b, d in zip(*factors, strict=True)] + [atom(point)], axis=1
    )
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
    jet = cost_jet(point, precision, residual, others, factors)
    step = 1e-5
    for axis in range(2):
        shift = np.eye(2)[axis] * step
        ahead = cost_jet(point + shift, precision, residual, others, factors)
        behind = cost_jet(point - shift, precision, residual, others, factors)
        # Central differences err by step^2/6 times the third derivative: here below 1e-5.
        slope = (ahead.value - behind.value) / (2 * step)
        assert jet.gradient[axis] == pytest.approx(slope, rel=1e-5)
        curvature = (ahead.gradient - behind.gradient) / (2 * step)
        np.testing.assert_allclose(jet.hessian[axis], curvature, rtol=1e-5)


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
    gradient = cost_jet(end, 0.0, residual, others, factors).gradient
    curvature = np.abs(np.diagonal(cost_jet(end, 0.0, residual, others, factors).hessian))
    assert np.all(np.abs(gradient) / np.sqrt(curvature) < 1e-6)


def test_single_ramp_keeps_doppler_at_zero():
    rng = np.random.default_rng(2)
    samples = np.arange(64)
    residual = np.exp(-2j * np.pi * 0.2 * samples)[None] + 0.1 * rng.standard_normal((1, 64))
    workspace = ObjectWorkspace(no_objects(), residual, 10.0, threshold=10.0, next_id=0)
    workspace.add_components(1)
    components = workspace.components()
    assert components.dopplers.tolist() == [0.0]
    # Root CRLB at this SNR is below 1e-3 of a cell; a hundredth of a cell is ten deviations.
    assert components.beats[0] == pytest.approx(0.2, abs=0.01 / 64)


def test_a_frequency_at_the_edge_wraps_around():
    residual = np.exp(-2j * np.pi * 0.4999 * np.arange(64))[None]
    residual = residual + 1e-3 * np.random.default_rng(1).standard_normal((1, 64))
    workspace = ObjectWorkspace(no_objects(), residual, 1e4, threshold=10.0, next_id=0)
    workspace.add_components(1)
    workspace.update_components()
    beat = workspace.components().beats[0]
    assert -0.5 <= beat < 0.5
    assert abs((beat - 0.4999 + 0.5) % 1.0 - 0.5) < 1e-4


def test_pruning_keeps_the_other_identities():
    rng = np.random.default_rng(4)
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    strong = 3.0 * atom((0.1, 0.1)) + 3.0 * atom((-0.25, -0.2))
    residual = strong.reshape(SHAPE) + 0.01 * noise
    workspace = ObjectWorkspace(no_objects(), residual, 100.0, threshold=10.0, next_id=5)
    workspace.add_components(2)
    before = workspace.components()
    assert before.component_ids.tolist() == [5, 6]
    first_gone = residual - (before.amplitudes[0] * atom(workspace.points[0])).reshape(SHAPE)
    again = ObjectWorkspace(before, first_gone, 100.0, threshold=10.0, next_id=7)
    again.update_components()
    assert again.components().component_ids.tolist() == [6]
    assert [event.kind for event in again.events] == [EventKind.OBJECT_PRUNED]
    assert again.events[0].component_id == 5


def test_noise_alone_is_rejected_and_said_so():
    rng = np.random.default_rng(8)
    noise = (rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)) / np.sqrt(2)
    workspace = ObjectWorkspace(no_objects(), noise, 1.0, threshold=30.0, next_id=0)
    workspace.add_components(1)
    assert workspace.components().num_components == 0
    assert [event.kind for event in workspace.events] == [EventKind.OBJECT_REJECTED]
