"""YALL1 reaches the same minimum as FISTA on another path."""

import numpy as np
import pytest

from tests.vsep.sparse_bench import sparse_problem
from vsep.mitigation.sparse.fista import Fista, objective
from vsep.mitigation.sparse.operators import MaskedFft
from vsep.mitigation.sparse.yall1 import Yall1

PENALTY = 0.05


def test_the_minimum_is_that_of_the_l1_problem():
    frame, mask, _ = sparse_problem(0, shape=(12, 20), share=0.5, noise=0.05, occupied=12)
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    minima = []
    for solver, iterations in ((Fista(penalty=PENALTY), 2000), (Yall1(penalty=PENALTY), 1000)):
        state = solver.init(operator, measured)
        for _ in range(iterations):
            state = solver.step(operator, measured, state)
        minima.append(state.spectrum)
    expected = objective(operator, measured, minima[0], PENALTY)
    assert objective(operator, measured, minima[1], PENALTY) == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(minima[1], minima[0], atol=1e-6)


def test_a_frame_of_zeros_has_a_spectrum_of_zeros():
    operator = MaskedFft(np.eye(4, dtype=bool), np.complex128)
    measured = np.zeros((4, 4), dtype=complex)
    solver = Yall1()
    state = solver.step(operator, measured, solver.init(operator, measured))
    assert not np.any(state.spectrum)
