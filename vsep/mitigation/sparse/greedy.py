"""Greedy pursuits: OMP adds one cell at a time, CoSaMP exchanges many."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.mitigation.sparse.filling import sparse_entry
from vsep.mitigation.sparse.operators import Samples, SensingOperator
from vsep.mitigation.sparse.solver import Solver, SolverState, gradient_std, zero_spectrum
from vsep.mitigation.sparse.support import least_squares

# A column that lies this close to the span of the chosen ones (squared sine of the angle) adds
# nothing but rounding.
_DEPENDENT = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class OmpState(SolverState):
    """Spectrum with the support that carries it."""

    #: (K,) chosen cells, counted along the stacked spectrum, in the order they were found
    cells: IntArray
    factor: ComplexArray  #: (K, K) lower Cholesky factor of their Gram matrix, double precision


@dataclass(frozen=True, kw_only=True, slots=True)
class Omp(Solver):
    """Orthogonal matching pursuit."""

    #: the pursuit ends when the largest cell of A^H r may be noise: with this rate the largest of
    #: PN cells of white noise exceeds ``sqrt(ln(PN / rate))`` standard deviations
    false_alarm_rate: float = 0.05
    max_cells: int = 1000  #: at most this many cells

    def init(self, operator: SensingOperator, measured: Samples) -> OmpState:
        """Zero spectrum, empty support."""
        return OmpState(
            spectrum=zero_spectrum(operator, measured),
            may_stop=False,
            cells=np.zeros(0, dtype=np.int64),
            factor=np.zeros((0, 0), dtype=np.complex128),
        )

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> OmpState:
        """Add the cell that explains most of the residual and solve for all chosen ones."""
        assert isinstance(state, OmpState)
        residual = measured - operator.forward(state.spectrum)
        magnitude = np.abs(operator.adjoint(residual)).ravel()
        magnitude[state.cells] = 0.0
        cell = int(np.argmax(magnitude))
        limit = _noise_limit(operator, residual, self.false_alarm_rate)
        full = len(state.cells) >= min(self.max_cells, operator.num_measurements)
        row = None if full or magnitude[cell] <= limit else _new_row(operator, state, cell)
        if row is None:
            return OmpState(
                spectrum=state.spectrum, may_stop=True, cells=state.cells, factor=state.factor
            )
        cells = np.append(state.cells, cell)
        factor = np.zeros((len(cells), len(cells)), dtype=np.complex128)
        factor[:-1, :-1] = state.factor
        factor[-1] = row
        projections = operator.adjoint(measured).ravel()[cells].astype(np.complex128)
        spectrum = np.zeros_like(state.spectrum)
        spectrum.reshape(-1)[cells] = cho_solve((factor, True), projections)
        return OmpState(spectrum=spectrum, may_stop=False, cells=cells, factor=factor)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CosampState(SolverState):
    """Spectrum with the size that the support may have."""

    num_cells: int  #: K of the last iteration


@dataclass(frozen=True, kw_only=True, slots=True)
class Cosamp(Solver):
    """Compressive sampling matching pursuit with a growing support.

    With the whole K from the start the first candidates are side lobes that the mask made of the
    strongest objects; where whole ramps are lost they explain the clean samples as well as the
    objects do, and the pursuit settles on them at once. So K grows.
    """

    #: the largest K; at most a third of the clean samples is used, because a least-squares problem
    #: of 3K unknowns is solved on the way
    num_cells: int = 300
    growth: int = 5  #: by how much K grows from one iteration to the next
    #: as of `Omp`: only cells of A^H r above its limit are candidates
    false_alarm_rate: float = 0.05

    def init(self, operator: SensingOperator, measured: Samples) -> CosampState:
        """Zero spectrum."""
        zero = zero_spectrum(operator, measured)
        return CosampState(spectrum=zero, may_stop=False, num_cells=0)

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> CosampState:
        """Merge the support with the 2K largest cells of A^H r, solve, keep the K largest."""
        assert isinstance(state, CosampState)
        largest = max(min(self.num_cells, operator.num_measurements // 3), 1)
        kept = min(state.num_cells + self.growth, largest)
        residual = measured - operator.forward(state.spectrum)
        proxy = np.abs(operator.adjoint(residual))
        limit = _noise_limit(operator, residual, self.false_alarm_rate)
        candidates = (proxy >= _largest(proxy, 2 * kept)) & (proxy > limit)
        merged = (state.spectrum != 0.0) | candidates
        solution = least_squares(operator, measured, merged, first=state.spectrum)
        magnitude = np.abs(solution)
        chosen = (magnitude >= _largest(magnitude, kept)) & (magnitude > 0.0)
        return CosampState(
            spectrum=least_squares(operator, measured, chosen, first=solution),
            may_stop=kept == largest or not np.any(candidates),
            num_cells=kept,
        )


def _noise_limit(operator: SensingOperator, residual: Samples, false_alarm_rate: float) -> float:
    """Level that the largest of PN cells of noise exceeds at a false-alarm rate."""
    noise = gradient_std(operator, residual)
    return noise * math.sqrt(math.log(operator.num_cells / false_alarm_rate))


def _largest(magnitude: FloatArray, count: int) -> float:
    """Magnitude of the `count`-th largest cell."""
    rank = max(magnitude.size - count, 0)
    return float(np.partition(magnitude.ravel(), rank)[rank])


def _new_row(operator: SensingOperator, state: OmpState, cell: int) -> ComplexArray | None:
    """Return the row that a cell adds to the Cholesky factor; None if its column is dependent."""
    new = np.array([cell])
    own = float(operator.inner_products(new, new)[0, 0].real)
    if not len(state.cells):
        return np.array([math.sqrt(own)], dtype=np.complex128)
    products = operator.inner_products(state.cells, new)[:, 0]
    row = solve_triangular(state.factor, products, lower=True).conj()
    rest = own - float(np.vdot(row, row).real)
    return np.append(row, math.sqrt(rest)) if rest > _DEPENDENT * own else None


_OMP = Omp()
ENTRIES = (
    sparse_entry(
        "omp",
        "OMP",
        160,
        "Orthogonal matching pursuit, which adds one cell after the other.",
        solver=_OMP,
        max_iterations=_OMP.max_cells + 1,
    ),
    sparse_entry(
        "cosamp",
        "CoSaMP",
        170,
        "Compressive sampling matching pursuit, which exchanges many cells at once.",
        solver=Cosamp(),
    ),
)
