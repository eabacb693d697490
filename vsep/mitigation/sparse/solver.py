"""Protocol of the sparse solvers, in the operator's own form."""

from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from vsep._typing import frozen
from vsep.inference.core.progress import Termination
from vsep.mitigation.sparse.operators import Samples, SensingOperator


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SolverState:
    """The current spectrum, and whether a small change of it means the end."""

    spectrum: Samples  #: x_t, in the operator's form
    may_stop: bool  #: False while a threshold still falls or a support still grows

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        freeze_arrays(self)


class Solver(Protocol):
    """A frozen bag of settings with ``init``, ``step`` and ``terminate``."""

    def init(self, operator: SensingOperator, measured: Samples) -> SolverState:
        """State before the first step; its spectrum is zero."""

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> SolverState:
        """One iteration, at the cost of one residual update or a few."""

    def terminate(self, state: SolverState, *, settled: bool) -> Termination:
        """Whether a run goes on after a step; `settled` says that it changed next to nothing."""
        return Termination.CONVERGED if settled and state.may_stop else Termination.RUNNING


def freeze_arrays(record: Any) -> None:
    """Make the arrays of a record read-only, for its ``__post_init__``."""
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray) and value.flags.writeable:
            object.__setattr__(record, field.name, frozen(value))


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
    operator: SensingOperator, measured: Samples, spectrum: Samples, step_width: float = 1.0
) -> tuple[float, Samples]:
    """Return std(A^H r) of (12) and the step x + theta A^H r of (11) and (17), r = y - A x."""
    residual = operator.forward(spectrum)
    np.subtract(measured, residual, out=residual)
    noise = gradient_std(operator, residual)
    updated = operator.adjoint_of_scratch(residual)
    if step_width != 1.0:
        updated *= step_width
    updated += spectrum
    return noise, updated
