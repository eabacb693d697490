"""Mitigation methods of a single step, from the received frame to the cleaned one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

from vsep._typing import BoolArray, frozen
from vsep.inference.core.progress import Termination
from vsep.mitigation.entry import MitigationEntry, time_domain_entry
from vsep.mitigation.method import FrameArray, MitigationState, require_clean

Repair: TypeAlias = Callable[[FrameArray, BoolArray], FrameArray]


@dataclass(frozen=True, slots=True)
class DirectMitigation:
    """A method of one step."""

    name: str  #: the name a user calls it by
    #: takes the (P, N) frame and the mask of interfered samples, at least one of them clean;
    #: returns the cleaned frame. A function of a module, so that the method can be pickled.
    repair: Repair

    def init(self, received: FrameArray, mask: BoolArray) -> MitigationState:
        """State before the step: the received frame itself.

        Raises `InputError` if no sample is clean.
        """
        require_clean(mask)
        return MitigationState(iteration=0, cleaned=received)

    def step(
        self, received: FrameArray, mask: BoolArray, state: MitigationState
    ) -> MitigationState:
        """Repair the frame."""
        cleaned = self.repair(received, mask).astype(received.dtype, copy=False)
        return MitigationState(iteration=state.iteration + 1, cleaned=frozen(cleaned), change=0.0)

    def terminate(self, state: MitigationState) -> Termination:
        """After one step."""
        return Termination.CONVERGED if state.iteration >= 1 else Termination.RUNNING


def direct_entry(
    name: str, label: str, position: int, help: str, repair: Repair
) -> MitigationEntry:
    """Return the record of a method of one step without settings."""
    factory = partial(DirectMitigation, name=name, repair=repair)
    return time_domain_entry(name, label, position, help, factory)
