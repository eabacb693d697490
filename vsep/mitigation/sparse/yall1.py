"""YALL1: the alternating direction method (ADMM) on the dual of the l1 problem (10).

    minimise ||x||_1 + 1/(2 nu) ||A x - y||^2

The rows of A are orthonormal, so every step is in closed form (Yang and Zhang, 2011): with the dual
vector d of the samples and its image z, clipped to magnitude one in every cell,

    z = clip(A^H d + x / mu),   d = mu/(mu + nu) (A z - (A x - y)/mu),   x += 1.618 mu (A^H d - z)

Unless it is given, nu follows the residual by (12) as in the other methods.
"""

from dataclasses import dataclass

import numpy as np

from vsep.mitigation.sparse.filling import sparse_entry
from vsep.mitigation.sparse.operators import Samples, SensingOperator
from vsep.mitigation.sparse.solver import Solver, SolverState, gradient_std, zero_spectrum
from vsep.mitigation.sparse.thresholding import SOFT_CONTROL

_STEP = 1.618  # converges below the golden ratio, (1 + sqrt 5)/2 = 1.618034


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Yall1State(SolverState):
    """Primal spectrum with the dual vector."""

    dual_image: Samples  #: A^H d, in the form of the spectrum


@dataclass(frozen=True, kw_only=True, slots=True)
class Yall1(Solver):
    """Alternating directions on the dual problem."""

    control: float = 2.0  #: beta of (12), which sets nu
    scaling: float = 1.0  #: mu in units of the mean magnitude of the clean samples
    penalty: float | None = None  #: nu, in the unit of the spectrum; by (12) if None

    def init(self, operator: SensingOperator, measured: Samples) -> Yall1State:
        """Zero spectrum, zero dual vector."""
        zero = zero_spectrum(operator, measured)
        return Yall1State(spectrum=zero, may_stop=True, dual_image=zero)

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> Yall1State:
        """Clip, then solve for the dual vector, then move the spectrum: two masked updates."""
        assert isinstance(state, Yall1State)
        level = float(np.abs(measured).sum()) / operator.num_measurements
        scaling = self.scaling * level
        if scaling == 0.0:
            return state
        residual = operator.forward(state.spectrum) - measured
        penalty = self.penalty
        if penalty is None:
            penalty = self.control * gradient_std(operator, residual)
        clipped = _clip(state.dual_image + state.spectrum / scaling)
        dual = (scaling * operator.forward(clipped) - residual) / (scaling + penalty)
        dual_image = operator.adjoint(dual)
        moved = (_STEP * scaling) * (dual_image - clipped)
        return Yall1State(spectrum=state.spectrum + moved, may_stop=True, dual_image=dual_image)


def _clip(values: Samples) -> Samples:
    """Reduce to magnitude one what exceeds it."""
    return np.asarray(values / np.maximum(np.abs(values), 1.0))


ENTRIES = (
    sparse_entry(
        "yall1",
        "YALL1",
        200,
        "Alternating directions (ADMM) on the dual of the l1 problem.",
        solver=Yall1(control=SOFT_CONTROL),
    ),
)
