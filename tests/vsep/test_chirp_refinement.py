"""Refinement of (71) against its dense definition and finite differences."""

import numpy as np
import pytest

from tests.vsep.burst_bench import GRID, MODEL, burst, dense_channel, noise
from tests.vsep.conftest import central_differences
from vsep.inference.bursts.chirp_refinement import ChannelCosts, place_chirps, refine_chirps
from vsep.kernels.gauss_newton import RIDGE, newton_step
from vsep.kernels.ramps import FlatRamps

OWNERS, BINS = np.array([0, 1, 0]), np.array([0, 1, 7])
FIRST = np.zeros(1, dtype=int)  # ramp, and burst
OTHER = burst(-0.5, 0.0123)  # crosses the burst that is refined


def cost_of(residual, precisions, noise_precision):
    """Cost (71) of a ramp with two crossing bursts, by the template of the first."""
    templates = np.stack([burst(0.78, -0.0118), OTHER])
    first_burst, first_column = np.array([0, 2]), np.array([0, 3])
    columns = FlatRamps(
        templates, first_burst, OWNERS, BINS, precisions, first_column, GRID.twiddle
    )
    return ChannelCosts(
        ramps=columns,
        moving=FIRST,
        shared=FIRST,
        residual=residual[None],
        noise_precision=noise_precision,
    )


def test_cost_is_the_dense_expression_71_up_to_the_weights_it_names():
    template, precisions, noise_precision = burst(0.78, -0.0118), np.array([0.2, 0.5, 1.0]), 30.0
    residual = template * 2.0 + noise(2, 0.1)
    cost = cost_of(residual, precisions, noise_precision).values(FIRST, template[None])[0]
    templates = np.stack([template, OTHER])
    columns = [dense_channel(templates[b])[:, k] for b, k in zip(OWNERS, BINS, strict=True)]
    atoms = np.stack(columns, axis=1)
    covariance = np.linalg.inv(noise_precision * atoms.conj().T @ atoms + np.diag(precisions))
    projected = atoms.conj().T @ residual
    fit = noise_precision**2 * (projected.conj() @ covariance @ projected).real
    expected = np.linalg.slogdet(covariance)[1] + fit
    assert cost == pytest.approx(expected, rel=1e-11)


def test_gradient_equals_finite_differences():
    start, slope, reference = 0.781, -0.01175, 66.0
    precisions, noise_precision = np.array([0.2, 0.5, 1.0]), 30.0
    residual = burst(0.78, -0.0118) * (2.0 + 0.4j) + OTHER * 1.5j + noise(3, 0.1)

    model_cost = cost_of(residual, precisions, noise_precision)

    def cost(frequency_step, slope_step):
        moved = burst(start + frequency_step - slope_step * reference, slope + slope_step)
        return model_cost.values(FIRST, moved[None])[0]

    template, derivatives = MODEL.template_jet(start, slope, reference)
    (value,), (gradient,), (curvature,) = model_cost.slopes(
        FIRST, template[None], derivatives[None]
    )
    assert value == pytest.approx(cost(0.0, 0.0), rel=1e-12)
    differences = central_differences(cost, (1e-6, 1e-8))
    # Rounding of a cost near 1e4 over the step and the third derivative both stay below 1e-5.
    np.testing.assert_allclose(gradient, differences, rtol=1e-4)
    assert np.all(np.linalg.eigvalsh(curvature) > 0)


def test_refinement_never_lowers_the_cost():
    rng = np.random.default_rng(9)
    residual = burst(0.78, -0.0118) + noise(5, 0.3)
    cost = cost_of(residual, np.full(3, 0.5), 5.0)
    for _ in range(20):
        start = rng.uniform(0.5, 1.0)
        slope = -start / rng.uniform(20.0, 110.0)
        before = place_chirps(np.array([start]), np.array([slope]), MODEL)
        moved = refine_chirps(before, MODEL, cost)
        after, before = moved.templates, burst(start, slope)[None]
        assert cost.values(FIRST, after) >= cost.values(FIRST, before)


def test_the_step_solves_the_ridged_equations():
    curvature = np.array([[3.0, -1.0], [-1.0, 2.0]])
    gradient = np.array([0.5, -4.0])
    ridged = curvature + np.diag(RIDGE * np.diagonal(curvature))
    # Cramer's rule in double precision on numbers near one.
    assert newton_step(gradient, curvature) == pytest.approx(
        np.linalg.solve(ridged, gradient).tolist(), rel=1e-13
    )


def test_without_curvature_there_is_no_step():
    assert newton_step(np.zeros(2), np.zeros((2, 2))) == (0.0, 0.0)
    # A burst whose slope plays no part.
    assert newton_step(np.array([1.0, 0.0]), np.diag([2.0, 0.0])) == (0.0, 0.0)
