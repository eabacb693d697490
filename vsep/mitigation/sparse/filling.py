"""Any sparse solver as a mitigation method: window, solve iteration by iteration, fill the gaps.

A window in both dimensions comes before the solver. Without it every object off the grid leaks into
all cells and the spectrum is not sparse; a diagonal window commutes with the mask, so it costs
nothing. The measured samples stay as they are, only the gaps are filled: with the frame that the
sparse spectrum synthesises, divided by the window.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast, get_args

import numpy as np

from vsep._typing import BoolArray, frozen
from vsep._validation import require_choice, require_range
from vsep.inference.core.progress import Termination
from vsep.mitigation.entry import COMPRESSIVE_SENSING, MitigationEntry
from vsep.mitigation.method import FrameArray, MitigationState, require_clean
from vsep.mitigation.sparse.operators import (
    DOMAINS,
    Domain,
    RealSamples,
    Samples,
    SensingOperator,
    make_operator,
)
from vsep.mitigation.sparse.solver import Solver, SolverState, freeze_arrays
from vsep.mitigation.sparse.support import least_squares
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.spectra import Window, window_weights

# No frame has this many times the energy of its clean samples, scaled to the whole frame.
_RUNAWAY = 100.0


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SparseMemory:
    """What the next step needs beside the cleaned frame."""

    operator: SensingOperator  #: A of the frame's mask
    measured: Samples  #: windowed clean samples, scaled to unit power, in the operator's form
    scale: float  #: the factor that was divided out
    window: RealSamples  #: (P, N) the window
    solution: SolverState  #: where the solver stands
    #: verdict on the solver; what may follow its end is the debiasing step
    termination: Termination = Termination.RUNNING
    debiased: bool = False  #: whether that step is done

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        freeze_arrays(self)

    @property
    def spectrum(self) -> Samples:
        """(P, N) range-Doppler spectrum of the windowed frame, at the frame's own level."""
        return self.operator.to_map(self.solution.spectrum) * self.scale


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SparseMitigation:
    """A sparse solver behind the interface of mitigation methods.

    Raises `InputError` if a setting is out of its range.
    """

    name: str  #: the name a user calls it by
    solver: Solver  #: one of the solvers of this package
    domain: Domain = "masked-2d"  #: "masked-2d" or "explicit-1d"; the iterates are the same
    window: Window = "hann"  #: "hann" or "rectangular", in both dimensions
    #: A run has settled when the spectrum changes by less than this share of its norm. At 1e-2
    #: iterative soft thresholding would stop some 10 dB too early.
    tolerance: float = 1e-3
    max_iterations: int = 300  #: at most this many iterations
    #: whether a last step fits the cells found by least squares, which undoes what a threshold took
    #: from them
    debias: bool = False
    dither: RampDither | None = None  #: how ramps were dithered

    def __post_init__(self) -> None:
        """Check the settings that are not checked elsewhere."""
        require_choice("The domain", self.domain, DOMAINS)
        require_choice("window", self.window, get_args(Window))
        require_range("tolerance", self.tolerance, 1e-12, 1.0)
        require_range("max_iterations", self.max_iterations, 1, 1_000_000)

    def init(self, received: FrameArray, mask: BoolArray) -> MitigationState:
        """State before the first step: the gaps are zero.

        Raises `InputError` if no sample is clean, or the explicit matrix would not fit into memory.
        """
        require_clean(mask)
        if not np.any(mask):
            return MitigationState(iteration=0, cleaned=received, change=0.0)
        slow, fast = (window_weights(count, self.window) for count in received.shape)
        window = np.outer(slow, fast).astype(received.real.dtype)
        scale = _level(window * received, mask)
        operator = make_operator(self.domain, mask, received.dtype, self.dither)
        measured = operator.measured((window * received) * (1.0 / scale))
        memory = SparseMemory(
            operator=operator,
            measured=measured,
            scale=scale,
            window=window,
            solution=self.solver.init(operator, measured),
        )
        return MitigationState(iteration=0, cleaned=_filled(received, mask, memory), memory=memory)

    def step(
        self, received: FrameArray, mask: BoolArray, state: MitigationState
    ) -> MitigationState:
        """One iteration of the solver, or the debiasing step after its last one."""
        memory = cast(SparseMemory, state.memory)
        debiasing = memory.termination is not Termination.RUNNING
        if debiasing:
            support = np.abs(memory.solution.spectrum) > _noise(memory)
            spectrum = least_squares(memory.operator, memory.measured, support)
            solution = replace(memory.solution, spectrum=spectrum)
        else:
            solution = self.solver.step(memory.operator, memory.measured, memory.solution)
        if not _is_sound(solution.spectrum, memory):
            # An approximate message passing that runs away ends with its last good spectrum.
            kept = replace(memory, termination=Termination.NONFINITE)
            return replace(state, iteration=state.iteration + 1, change=0.0, memory=kept)
        change = _relative_change(solution.spectrum, memory.solution.spectrum)
        termination = memory.termination
        if not debiasing:
            termination = self.solver.terminate(solution, settled=change < self.tolerance)
            if termination is Termination.RUNNING and state.iteration + 1 >= self.max_iterations:
                termination = Termination.MAX_ITERATIONS
        memory = replace(memory, solution=solution, termination=termination, debiased=debiasing)
        return MitigationState(
            iteration=state.iteration + 1,
            cleaned=_filled(received, mask, memory),
            change=change,
            memory=memory,
        )

    def terminate(self, state: MitigationState) -> Termination:
        """When the solver has terminated and the debiasing, if wanted, is done."""
        if state.memory is None:
            return Termination.CONVERGED
        memory = cast(SparseMemory, state.memory)
        waiting = self.debias and not memory.debiased
        if waiting and memory.termination is not Termination.NONFINITE:
            return Termination.RUNNING
        return memory.termination


def _level(frame: FrameArray, mask: BoolArray) -> float:
    """Root mean square of the clean samples; one if they are zero."""
    clean = frame[~mask].astype(np.complex128)
    peak = float(np.abs(clean).max())
    # Squares of very small or large samples would leave the range of floats.
    return peak * float(np.sqrt(np.mean(np.abs(clean / peak) ** 2))) if peak > 0.0 else 1.0


def _noise(memory: SparseMemory) -> float:
    """Return the standard deviation of a cell of A^H r, below which a cell may be noise."""
    operator = memory.operator
    residual = memory.measured - operator.forward(memory.solution.spectrum)
    return float(np.linalg.norm(residual) / np.sqrt(operator.num_cells))


def _filled(received: FrameArray, mask: BoolArray, memory: SparseMemory) -> FrameArray:
    """Fill the gaps with the synthesised frame, divided by the window.

    Where the window is small a plain division would blow up the error of the spectrum. With an
    error of power e^2 a sample on a windowed signal of power s^2 w^2, the linear estimate of least
    mean squared error is ``w v / (w^2 + e^2 / s^2)``. The K cells that exceed the noise
    carry the share K/q of the residual's power over to the synthesised frame.
    """
    operator, window = memory.operator, memory.window
    spectrum = memory.solution.spectrum
    noise = _noise(memory)
    occupied = np.count_nonzero(np.abs(spectrum) > noise)
    share = min(occupied / operator.num_measurements, 1.0)
    error = noise**2 * operator.num_cells / operator.num_measurements * share
    unwindowed = np.where(mask, 0.0, received).astype(np.complex128)
    power = float(np.sum(np.abs(unwindowed / memory.scale) ** 2)) / operator.num_measurements
    synthesised = operator.synthesis(spectrum)
    gain = memory.scale * window / (window**2 + (error / power if power > 0.0 else 0.0))
    cleaned: FrameArray = np.where(mask, synthesised * gain, received)
    return frozen(cleaned.astype(received.dtype, copy=False))


def _is_sound(spectrum: Samples, memory: SparseMemory) -> bool:
    """Whether a spectrum is finite and of an energy that a frame can have."""
    energy = float(np.vdot(spectrum, spectrum).real)
    clean = float(np.vdot(memory.measured, memory.measured).real)
    share = memory.operator.num_measurements / memory.operator.num_cells
    return energy <= _RUNAWAY * clean / share


def _relative_change(spectrum: Samples, previous: Samples) -> float:
    norm = float(np.linalg.norm(spectrum))
    moved = float(np.linalg.norm(spectrum - previous))
    return moved / norm if norm > 0.0 else moved


def sparse_entry(name: str, label: str, position: int, help: str, **fixed: Any) -> MitigationEntry:
    """Return the record of a method that is `SparseMitigation` with some settings fixed."""
    factory = partial(SparseMitigation, name=name, **fixed)
    return MitigationEntry(
        name=name,
        label=label,
        help=help,
        factory=factory,
        group=COMPRESSIVE_SENSING,
        position=position,
    )
