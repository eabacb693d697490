"""Iterative soft and hard thresholding."""

import numpy as np
import pytest

from tests.vsep.sparse_bench import sparse_problem
from vsep.mitigation.sparse.operators import MaskedFft
from vsep.mitigation.sparse.solver import gradient_std
from vsep.mitigation.sparse.thresholding import (
    IterativeThresholding,
    hard_threshold,
    soft_threshold,
)


def test_thresholds_minimise_their_penalties():
    # Brute force over a fine grid of magnitudes; the phase of the minimiser is that of the value.
    grid = np.linspace(0.0, 3.0, 30001)
    for magnitude in (0.2, 0.9, 1.4142, 2.5):
        value = magnitude * np.exp(1j)
        fit = 0.5 * np.abs(grid * np.exp(1j) - value) ** 2
        soft = grid[np.argmin(fit + 0.7 * grid)]
        hard = grid[np.argmin(fit + 0.5 * 0.7**2 * (grid > 0.0))]
        assert abs(soft_threshold(np.array([value]), 0.7)[0]) == pytest.approx(soft, abs=1e-4)
        assert abs(hard_threshold(np.array([value]), 0.7)[0]) == pytest.approx(hard, abs=1e-4)


def test_the_deviation_of_the_gradient_is_that_of_its_cells():
    frame, mask, _ = sparse_problem(0)
    operator = MaskedFft(mask, np.complex128)
    residual = operator.measured(frame)
    direct = np.sqrt(np.mean(np.abs(operator.adjoint(residual)) ** 2))
    assert gradient_std(operator, residual) == pytest.approx(direct, rel=1e-13)


@pytest.mark.parametrize("shrinkage", ["soft", "hard"])
def test_one_iteration_is_equations_11_and_12(shrinkage):
    frame, mask, _ = sparse_problem(1)
    operator = MaskedFft(mask, np.complex128)
    measured = np.where(mask, 0.0, frame)
    solver = IterativeThresholding(shrinkage=shrinkage, control=1.5)
    first = solver.step(operator, measured, solver.init(operator, measured))
    second = solver.step(operator, measured, first)
    residual = np.where(mask, 0.0, frame - np.fft.fft2(first.spectrum, norm="ortho"))
    gradient = np.fft.ifft2(residual, norm="ortho")
    threshold = 1.5 * np.sqrt(np.mean(np.abs(gradient) ** 2))
    value = first.spectrum + gradient
    kept = np.abs(value) > threshold
    shrunk = value * (1.0 - threshold / np.abs(value)) if shrinkage == "soft" else value
    np.testing.assert_allclose(second.spectrum, np.where(kept, shrunk, 0.0), atol=1e-14)


def test_the_schedule_falls_from_the_largest_cell():
    frame, mask, _ = sparse_problem(2)
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    solver = IterativeThresholding(shrinkage="hard", control=1e-6, decay=0.8)
    state = solver.init(operator, measured)
    peak = np.abs(operator.adjoint(measured)).max()
    for iteration in range(8):
        assert state.floor == pytest.approx(0.8**iteration * peak, rel=1e-12)
        assert not state.may_stop
        state = solver.step(operator, measured, state)
        occupied = np.abs(state.spectrum[state.spectrum != 0.0])
        assert occupied.min(initial=np.inf) >= 0.8**iteration * peak * (1.0 - 1e-12)


def test_relief_lowers_the_threshold_of_its_cells_only():
    frame, mask, _ = sparse_problem(3)
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    relief = np.zeros(mask.shape)
    relief[2, 3] = 0.9
    plain, eased = (
        IterativeThresholding(shrinkage="soft", control=0.5, relief=given)
        for given in (None, relief)
    )
    before = plain.step(operator, measured, plain.init(operator, measured)).spectrum
    after = eased.step(operator, measured, eased.init(operator, measured)).spectrum
    others = relief == 0.0
    np.testing.assert_array_equal(after[others], before[others])
    threshold = 0.5 * gradient_std(operator, measured)
    value = operator.adjoint(measured)[2, 3]
    assert abs(value) > threshold
    assert abs(after[2, 3]) == pytest.approx(abs(value) - 0.1 * threshold, rel=1e-12)
