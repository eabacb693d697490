"""Least squares on a support against the dense solution."""

import numpy as np
import pytest

from tests.vsep.sparse_bench import sparse_problem
from vsep.mitigation.sparse.operators import DOMAINS, ExplicitMatrix, make_operator
from vsep.mitigation.sparse.support import least_squares


@pytest.mark.parametrize("domain", DOMAINS)
def test_least_squares_on_a_support_is_the_dense_one(domain):
    frame, mask, _ = sparse_problem(0, share=0.5, noise=0.05)
    operator = make_operator(domain, mask, np.complex128)
    support = np.random.default_rng(1).uniform(size=mask.shape) < 0.1
    measured = operator.measured(frame)
    found = operator.to_map(least_squares(operator, measured, operator.from_map(support)))
    matrix = ExplicitMatrix(mask, np.complex128)
    columns = np.array([matrix.forward(unit) for unit in np.eye(mask.size)[support.ravel()]]).T
    dense = np.linalg.lstsq(columns, frame[~mask], rcond=None)[0]
    # Conjugate gradients stop at a relative gradient of 1e-7.
    np.testing.assert_allclose(found[support], dense, atol=1e-6)
    assert not np.any(found[~support])


def test_a_good_start_saves_the_iterations():
    frame, mask, _ = sparse_problem(0)
    operator = make_operator("masked-2d", mask, np.complex128)
    support = np.random.default_rng(1).uniform(size=mask.shape) < 0.1
    measured = operator.measured(frame)
    solution = least_squares(operator, measured, support)
    again = least_squares(operator, measured, support, first=solution, max_iterations=0)
    np.testing.assert_array_equal(again, solution)
