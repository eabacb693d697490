"""FISTA: iterative soft thresholding with momentum, for the l1 problem (10).

    minimise 1/2 ||y - A x||^2 + nu ||x||_1

With a fixed penalty nu the objective falls as 1/t^2 and its minimum does not depend on the path.
Without one the threshold follows the residual by (12), as the other thresholding methods do.
"""

import math
from dataclasses import dataclass

import numpy as np

from vsep.mitigation.sparse.filling import sparse_entry
from vsep.mitigation.sparse.operators import Samples, SensingOperator
from vsep.mitigation.sparse.solver import Solver, SolverState, residual_update, zero_spectrum
from vsep.mitigation.sparse.thresholding import SOFT_CONTROL, soft_threshold


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FistaState(SolverState):
    """Spectrum with its extrapolation."""

    extrapolated: Samples  #: where the next gradient is taken
    momentum: float  #: t_k of the extrapolation, one at the start


@dataclass(frozen=True, kw_only=True, slots=True)
class Fista(Solver):
    """Fast iterative shrinkage-thresholding."""

    control: float = 2.0  #: beta of (12)
    penalty: float | None = None  #: nu, in the unit of the spectrum; by (12) if None

    def init(self, operator: SensingOperator, measured: Samples) -> FistaState:
        """Zero spectrum without momentum."""
        zero = zero_spectrum(operator, measured)
        return FistaState(spectrum=zero, may_stop=True, extrapolated=zero, momentum=1.0)

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> FistaState:
        """One gradient step from the extrapolated spectrum, one threshold, one extrapolation."""
        assert isinstance(state, FistaState)
        deviation, updated = residual_update(operator, measured, state.extrapolated)
        penalty = self.control * deviation if self.penalty is None else self.penalty
        spectrum = soft_threshold(updated, penalty)
        momentum = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * state.momentum**2))
        weight = (state.momentum - 1.0) / momentum
        return FistaState(
            spectrum=spectrum,
            may_stop=True,
            extrapolated=spectrum + weight * (spectrum - state.spectrum),
            momentum=momentum,
        )


def objective(
    operator: SensingOperator, measured: Samples, spectrum: Samples, penalty: float
) -> float:
    """Value of (10), 1/2 ||y - A x||^2 + nu ||x||_1."""
    residual = measured - operator.forward(spectrum)
    fit = 0.5 * float(np.vdot(residual, residual).real)
    return fit + penalty * float(np.abs(spectrum).sum())


ENTRIES = (
    sparse_entry(
        "fista",
        "FISTA",
        150,
        "Soft thresholding with momentum.",
        solver=Fista(control=SOFT_CONTROL),
    ),
)
