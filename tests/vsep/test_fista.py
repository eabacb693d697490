"""FISTA against PyLops."""

import numpy as np
import pylops
import pytest

from tests.vsep.sparse_bench import advanced, pylops_matrix, sparse_problem
from vsep.mitigation.sparse.fista import Fista, objective
from vsep.mitigation.sparse.operators import ExplicitMatrix, MaskedFft

PENALTY = 0.05


@pytest.fixture
def problem():
    frame, mask, _ = sparse_problem(0, shape=(12, 20), share=0.5, noise=0.05, occupied=12)
    return frame, mask


def test_the_objective_is_that_of_pylops_after_100_iterations(problem):
    frame, mask = problem
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    spectrum = advanced(Fista(penalty=PENALTY), operator, measured, 100).spectrum
    matrix = ExplicitMatrix(mask, np.complex128)
    # PyLops minimises ||y - A x||^2 + eps ||x||_1, twice our objective for eps = 2 nu.
    theirs, _, _ = pylops.optimization.sparsity.fista(
        pylops_matrix(matrix),
        frame[~mask],
        niter=100,
        eps=2.0 * PENALTY,
        alpha=1.0,
        tol=0.0,
    )
    expected = objective(matrix, frame[~mask], theirs, PENALTY)
    assert objective(operator, measured, spectrum, PENALTY) == pytest.approx(expected, rel=1e-6)
    # And the minimum does not lie at zero, where every solver would agree.
    assert np.count_nonzero(spectrum) > 3


def test_the_minimum_meets_its_optimality_condition(problem):
    frame, mask = problem
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    spectrum = advanced(Fista(penalty=PENALTY), operator, measured, 2000).spectrum
    gradient = operator.adjoint(measured - operator.forward(spectrum))
    # |A^H r| is nu where x is not zero, in its phase, and at most nu elsewhere. After 2000
    # iterations some 1e-15 is left.
    assert np.abs(gradient).max() <= PENALTY * (1.0 + 1e-12)
    occupied = spectrum != 0.0
    phase = spectrum[occupied] / np.abs(spectrum[occupied])
    np.testing.assert_allclose(gradient[occupied], PENALTY * phase, atol=1e-12 * PENALTY)
