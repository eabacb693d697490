"""Protocol of the mitigation methods, and the loop that runs them.

A method takes a frame and a mask of interfered samples and repairs the frame, iteration by
iteration where it iterates. Like the estimators, methods are frozen bags of settings with ``init``,
``step`` and ``terminate``; everything that changes is in the state, so that a run can be watched,
paused and resumed. Adding one is one file, see `MitigationEntry`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, frozen
from vsep.errors import InputError
from vsep.inference.core.progress import Termination

FrameArray: TypeAlias = NDArray[np.complexfloating[Any, Any]]
"""A frame in its own precision: complex64 stays complex64, all else is complex128."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MitigationState:
    """Where a method stands.

    Parameters
    ----------
    iteration : int
        Steps done.
    cleaned : (P, N) complex
        The frame as repaired so far, in the dtype of the frame received; read-only.
    change : float
        Relative change of the last iteration; infinite before the first, zero where nothing moved.
    memory : object or None
        What else the method's own next step needs: immutable and picklable.
    """

    iteration: int
    cleaned: FrameArray
    change: float = float("inf")
    memory: object | None = None


class Mitigation(Protocol):
    """A frozen bag of settings with ``init``, ``step`` and ``terminate``."""

    @property
    def name(self) -> str:
        """The name a user calls it by."""

    def init(self, received: FrameArray, mask: BoolArray) -> MitigationState:
        """State before the first step; raises `InputError` for an unusable frame or mask."""

    def step(
        self, received: FrameArray, mask: BoolArray, state: MitigationState
    ) -> MitigationState:
        """One iteration: a pure function of its arguments."""

    def terminate(self, state: MitigationState) -> Termination:
        """Whether a run goes on after this state; it may have ended before the first step."""


def iterate_mitigation(
    method: Mitigation, received: FrameArray, mask: BoolArray, state: MitigationState | None = None
) -> Iterator[MitigationState]:
    """Yield the state after every step, until the method terminates.

    Leaving the loop pauses the run; handing the last state back resumes it.

    Parameters
    ----------
    method : Mitigation
        Settings and step function.
    received : (P, N) complex
        The frame.
    mask : (P, N) bool
        True where a sample is interfered.
    state : MitigationState, optional
        Where to resume.

    Yields
    ------
    MitigationState
        Once per iteration; nothing if `state` is that of a finished run.

    Raises
    ------
    InputError
        If the frame or the mask cannot be used.
    """
    received = checked_frame(received)
    mask = checked_mask(mask, received)
    state = method.init(received, mask) if state is None else state
    while method.terminate(state) is Termination.RUNNING:
        state = method.step(received, mask, state)
        yield state


def mitigate(method: Mitigation, received: FrameArray, mask: BoolArray) -> MitigationState:
    """Run a method to its end and return the last state.

    Parameters
    ----------
    method, received, mask
        As for `iterate_mitigation`.

    Examples
    --------
    >>> import numpy as np
    >>> from vsep.mitigation.registry import make_mitigation
    >>> frame, mask = np.array([[1.0, 9.0, 1.0]]), np.array([[False, True, False]])
    >>> mitigate(make_mitigation("zeroing"), frame, mask).cleaned.real
    array([[1., 0., 1.]])
    """
    received = checked_frame(received)
    mask = checked_mask(mask, received)
    state = method.init(received, mask)
    for last in iterate_mitigation(method, received, mask, state):
        state = last
    return state


def checked_frame(received: FrameArray) -> FrameArray:
    """Return a frame in its own complex precision, read-only.

    Raises `InputError` if it is no (P, N) array of finite numbers with at least one sample.
    """
    received = np.asarray(received)
    if received.ndim != 2 or received.size == 0 or received.dtype.kind not in "iufc":
        raise InputError(
            f"received has shape {received.shape} and type {received.dtype}; "
            "it must be complex, (ramps, samples)."
        )
    if not np.all(np.isfinite(received)):
        raise InputError("received holds NaN or infinity; all its samples must be finite.")
    dtype = np.complex64 if received.dtype == np.complex64 else np.complex128
    return frozen(np.array(received, dtype=dtype))


def checked_mask(mask: BoolArray, received: FrameArray) -> BoolArray:
    """Return the mask of a frame, read-only.

    Raises `InputError` if it is not boolean or has another shape than the frame.
    """
    mask = np.asarray(mask)
    if mask.dtype != np.bool_ or mask.shape != received.shape:
        raise InputError(
            f"The mask has shape {mask.shape} and type {mask.dtype}; it must be boolean and of "
            f"the frame's shape, {received.shape}."
        )
    return frozen(np.array(mask))


def require_clean(mask: BoolArray) -> None:
    """Refuse a mask without a clean sample, for methods that restore from clean samples.

    Raises `InputError` if every sample is flagged.
    """
    if np.all(mask):
        raise InputError(
            f"All {mask.size} samples are flagged as interfered; at least one must be clean."
        )
