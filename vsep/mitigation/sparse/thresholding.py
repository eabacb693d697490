"""Iterative soft and hard thresholding, with a schedule and with a prior model: (11)-(15).

    x_{t+1} = T_lambda(x_t + theta A^H (y - A x_t)),   lambda_t = beta std(A^H r_t)

The step width theta of (11) is one, because the norm of A is. The source leaves open whether lambda
is constant, falls by a factor, or follows (12): all three can be had. Hard thresholding by (12)
alone locks on early artefacts of strong objects: in the first iterations the standard deviation is
made by side lobes, not by noise, and what passes once is never removed. The schedule keeps
``lambda_t >= decay^t max|A^H y|``, so that strong objects are settled before weak ones may enter.
With a prior the threshold of a cell is ``(1 - zeta(p)) lambda_t``, (13) and (15).

The values of beta and of the decay are those that do best on Simulation II; see
assets/docs/mitigation.md.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, TypeAlias, get_args

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_choice, require_range
from vsep.mitigation.entry import COMPRESSIVE_SENSING, MitigationEntry
from vsep.mitigation.sparse.filling import SparseMitigation, sparse_entry
from vsep.mitigation.sparse.operators import Domain, RealSamples, Samples, SensingOperator
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame
from vsep.mitigation.sparse.solver import Solver, SolverState, residual_update, zero_spectrum
from vsep.signal.dithered_atoms import RampDither

Shrinkage: TypeAlias = Literal["soft", "hard"]
Threshold: TypeAlias = Literal["adaptive", "constant", "falling"]
FALLING = 0.9  # factor of a falling threshold from one iteration to the next
SOFT_CONTROL = 2.5  # beta of the methods with a soft threshold


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ThresholdingState(SolverState):
    """Spectrum with the schedule."""

    floor: float  #: the schedule's bound on the next threshold; zero without a schedule
    noise: float = 0.0  #: level of noise in the cells of A^H y, for thresholds that do not adapt


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class IterativeThresholding(Solver):
    """IST and IHT, plain, with the schedule, and with a prior model."""

    shrinkage: Shrinkage  #: "soft" (13) or "hard" (15)
    control: float  #: beta of (12), typically 2 to 4
    #: factor of the schedule from one iteration to the next, below one; zero for no schedule
    decay: float = 0.0
    #: lambda follows (12); or is beta times the level of noise in A^H y, at once or at the end of a
    #: fall from its largest cell
    threshold: Threshold = "adaptive"
    step_width: float = 1.0  #: theta of (11), in (0, 1]
    #: (P, N) zeta(p) of every cell, in [0, 1): the share by which its threshold is lowered
    relief: FloatArray | None = None

    def __post_init__(self) -> None:
        """Check the settings."""
        require_choice("threshold", self.threshold, get_args(Threshold))
        require_range("step_width", self.step_width, 1e-6, 1.0)

    def init(self, operator: SensingOperator, measured: Samples) -> ThresholdingState:
        """Zero spectrum; the schedule starts at the largest cell of A^H y."""
        floor = noise = 0.0
        if self.decay > 0.0 or self.threshold != "adaptive":
            cells = np.abs(operator.adjoint(measured))
            floor = float(cells.max()) if self.threshold != "constant" else 0.0
            # The median of the power of noise is ln 2 times its mean.
            noise = float(np.median(cells) / np.sqrt(np.log(2.0)))
        return ThresholdingState(
            spectrum=zero_spectrum(operator, measured), may_stop=False, floor=floor, noise=noise
        )

    def step(
        self, operator: SensingOperator, measured: Samples, state: SolverState
    ) -> ThresholdingState:
        """One masked residual update and one threshold, (11) and (12)."""
        assert isinstance(state, ThresholdingState)
        deviation, updated = residual_update(operator, measured, state.spectrum, self.step_width)
        noise = self.control * (deviation if self.threshold == "adaptive" else state.noise)
        shrink = soft_threshold if self.shrinkage == "soft" else hard_threshold
        threshold = max(noise, state.floor)
        return ThresholdingState(
            spectrum=shrink(updated, self._thresholds(operator, threshold, updated)),
            may_stop=state.floor <= noise,
            floor=(FALLING if self.threshold == "falling" else self.decay) * state.floor,
            noise=state.noise,
        )

    def _thresholds(
        self, operator: SensingOperator, threshold: float, like: Samples
    ) -> float | RealSamples:
        if self.relief is None:
            return threshold
        kept = np.asarray(1.0 - self.relief, dtype=like.real.dtype)
        return operator.from_map(kept) * threshold


def soft_threshold(values: Samples, threshold: float | RealSamples) -> Samples:
    """Shrink the magnitude of every value by the threshold, at most to zero, (13).

    Examples
    --------
    >>> soft_threshold(np.array([3.0 + 4.0j, 0.5j]), 1.0)
    array([2.4+3.2j, 0. +0.j ])
    """
    magnitude = np.abs(values)
    # No value is divided by zero: where the magnitude is zero so is the numerator.
    smallest = np.finfo(magnitude.dtype).tiny
    factor = np.maximum(magnitude - threshold, 0.0) / np.maximum(magnitude, smallest)
    return np.asarray(values * factor)


def hard_threshold(values: Samples, threshold: float | RealSamples) -> Samples:
    """Keep the values whose magnitude reaches the threshold, (15).

    Examples
    --------
    >>> hard_threshold(np.array([3.0 + 4.0j, 0.5j]), 1.0)
    array([3.+4.j, 0.+0.j])
    """
    return np.where(np.abs(values) >= threshold, values, np.zeros(1, dtype=values.dtype))


_SOFT = IterativeThresholding(shrinkage="soft", control=SOFT_CONTROL)
_HARD = IterativeThresholding(shrinkage="hard", control=3.5, decay=0.8)
SOFT_PRIOR = PriorModel()
HARD_PRIOR = PriorModel(largest=0.3)


def with_prior(
    *,
    name: str,
    solver: IterativeThresholding,
    prior: PriorModel,
    history: tuple[SeenFrame, ...] = (),
    domain: Domain = "masked-2d",
    debias: bool = False,
    dither: RampDither | None = None,
) -> SparseMitigation:
    """Make iterative thresholding with a prior from past frames; without any it is `solver` alone.

    `name`, `solver`, `domain`, `debias`, `dither` as of `SparseMitigation`; `prior`: the model;
    `history`: what it has seen.
    """
    solver = replace(solver, relief=prior.relief(history))
    return SparseMitigation(name=name, solver=solver, domain=domain, debias=debias, dither=dither)


pm_ist = partial(with_prior, name="pm-ist", solver=_SOFT, prior=SOFT_PRIOR)
pm_iht = partial(with_prior, name="pm-iht", solver=_HARD, prior=HARD_PRIOR)

ENTRIES = (
    sparse_entry("ist", "IST", 100, "Iterative soft thresholding, (11)-(13).", solver=_SOFT),
    sparse_entry("iht", "IHT", 110, "Iterative hard thresholding with a schedule.", solver=_HARD),
    sparse_entry(
        "iht-plain",
        "IHT, plain",
        120,
        "Iterative hard thresholding by (12) alone, for comparison: it fails.",
        solver=replace(_HARD, decay=0.0),
    ),
    *(
        MitigationEntry(
            name=name,
            label=name.upper(),
            help=f"{kind} thresholding with a prior model of the last frames of a sequence.",
            factory=factory,
            group=COMPRESSIVE_SENSING,
            position=position,
            prior=prior,
        )
        for name, kind, factory, position, prior in (
            ("pm-ist", "Soft", pm_ist, 130, SOFT_PRIOR),
            ("pm-iht", "Hard", pm_iht, 140, HARD_PRIOR),
        )
    ),
)
