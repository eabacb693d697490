"""What every sparse solver offers: a start and a pure step, in the operator's own form."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vsep.mitigation.sparse.operators import Samples, SensingOperator


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SolverState:
    """The current spectrum, and whether a small change of it means the end.

    Parameters
    ----------
    spectrum : complex
        x_t, in the operator's form.
    may_stop : bool
        False while a threshold still falls or a support still grows.
    """

    spectrum: Samples
    may_stop: bool


class Solver(Protocol):
    """A frozen bag of settings with a start and a step."""

    def start(self, operator: SensingOperator, measured: Samples) -> SolverState:
        """State before the first step; its spectrum is zero."""

    def advance(
        self, operator: SensingOperator, measured: Samples, state: SolverState
    ) -> SolverState:
        """One iteration, at the cost of one residual update or a few."""


def zero_spectrum(operator: SensingOperator, measured: Samples) -> Samples:
    """Return the spectrum x_0 = 0 in the form and precision of the measurement."""
    return np.zeros_like(operator.adjoint(measured))


def gradient_std(operator: SensingOperator, residual: Samples) -> float:
    """Return the standard deviation of the cells of A^H r with zero mean, as in (12).

    The rows of A are orthonormal, so it is the norm of r itself over the root of the number of
    cells: no transform and no pass over the cells is needed.
    """
    return float(np.linalg.norm(residual) / np.sqrt(operator.num_cells))


def residual_update(
    operator: SensingOperator, measured: Samples, spectrum: Samples
) -> tuple[float, Samples]:
    """Return std(A^H r) of (12) and the gradient step x + A^H r of (11) and (17), r = y - A x."""
    residual = operator.forward(spectrum)
    np.subtract(measured, residual, out=residual)
    noise = gradient_std(operator, residual)
    updated = operator.adjoint_of_scratch(residual)
    updated += spectrum
    return noise, updated
