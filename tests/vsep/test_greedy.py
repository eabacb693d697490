"""Greedy pursuits: OMP against PyLops, CoSaMP on what it must recover."""

import numpy as np
import pylops
import pytest

from tests.vsep.sparse_bench import advanced, pylops_matrix, sparse_problem
from vsep.mitigation.sparse.greedy import Cosamp, Omp
from vsep.mitigation.sparse.operators import DOMAINS, ExplicitMatrix, MaskedFft, make_operator


@pytest.mark.parametrize("domain", DOMAINS)
def test_omp_is_that_of_pylops(domain):
    frame, mask, _ = sparse_problem(0, shape=(12, 20), share=0.5, noise=0.05, occupied=12)
    operator = make_operator(domain, mask, np.complex128)
    # A high rate, so that only the number of cells ends the pursuit.
    solver = Omp(false_alarm_rate=100.0, max_cells=9)
    state = advanced(solver, operator, operator.measured(frame), 10)
    assert len(state.cells) == 9
    assert state.may_stop
    theirs, _, _ = pylops.optimization.sparsity.omp(
        pylops_matrix(ExplicitMatrix(mask, np.complex128)),
        frame[~mask],
        niter_outer=9,
        niter_inner=200,
        sigma=0.0,
        normalizecols=True,
    )
    np.testing.assert_allclose(operator.to_map(state.spectrum).ravel(), theirs, atol=1e-5)
    # 1e-5 is far below any value: the smallest chosen one counts.
    assert np.abs(theirs[state.cells]).min() > 0.01


@pytest.mark.parametrize("solver", [Omp(), Cosamp(num_cells=4, growth=2)])
def test_few_cells_on_the_grid_are_found_exactly(solver):
    frame, mask, spectrum = sparse_problem(1, noise=0.0)
    operator = MaskedFft(mask, np.complex128)
    found = advanced(solver, operator, operator.measured(frame), 6).spectrum
    # The least squares of CoSaMP stop at a relative gradient of 1e-7.
    np.testing.assert_allclose(found, spectrum, atol=1e-6)


@pytest.mark.parametrize("solver", [Omp(), Cosamp()])
def test_noise_holds_no_cells(solver):
    rng = np.random.default_rng(2)
    mask = rng.uniform(size=(16, 32)) < 0.2
    operator = MaskedFft(mask, np.complex128)
    empty = 0
    for _ in range(40):
        noise = rng.standard_normal(mask.shape) + 1j * rng.standard_normal(mask.shape)
        state = advanced(solver, operator, operator.measured(noise), 1)
        empty += not np.any(state.spectrum)
        assert state.may_stop == (not np.any(state.spectrum))
    # At a rate of 0.05 two of 40 are expected; more than eight have a chance of 2e-4.
    assert empty >= 32


def test_omp_adds_no_column_that_the_others_hold():
    # Two clean samples carry two columns, no third.
    mask = np.ones((4, 4), dtype=bool)
    mask[0, :2] = False
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(np.arange(16).reshape(4, 4) + 1.0 + 0j)
    state = advanced(Omp(false_alarm_rate=16.0), operator, measured, 5)
    assert len(state.cells) == 2
    assert state.may_stop
    np.testing.assert_allclose(operator.forward(state.spectrum), measured, atol=1e-12)


def test_cosamp_grows_up_to_a_third_of_the_samples():
    frame, mask, _ = sparse_problem(3, noise=0.5)
    operator = MaskedFft(mask, np.complex128)
    solver = Cosamp(growth=7, false_alarm_rate=100.0)
    sizes = []
    state = solver.init(operator, operator.measured(frame))
    for _ in range(8):
        state = solver.step(operator, operator.measured(frame), state)
        sizes.append(state.num_cells)
        assert np.count_nonzero(state.spectrum) <= state.num_cells
    largest = operator.num_measurements // 3
    assert sizes == [min(7 * count, largest) for count in range(1, 9)]
