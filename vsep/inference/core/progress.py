"""Diagnostics of a step and outcome of a run.

Diagnostics only: dropping an `IterationInfo` never changes a result.
"""

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from vsep.inference.core.state import ObjectComponents, SeparationState


class EventKind(enum.Enum):
    """Kinds of changes of a component or a burst in one step."""

    OBJECT_ADDED = "object added"
    OBJECT_PRUNED = "object pruned"
    OBJECT_REJECTED = "object candidate rejected"
    CHANNEL_ADDED = "channel component added"
    CHANNEL_PRUNED = "channel component pruned"
    FILTER_ADDED = "filter correction added"
    FILTER_PRUNED = "filter correction pruned"
    CHIRP_STARTED = "burst found"
    CHIRP_DROPPED = "burst dropped"
    CHIRP_RESTARTED = "burst search restarted"
    RECEIVER_CHANGED = "receiver errors estimated"


class ComponentEvent(NamedTuple):
    """One event of a step; there are tens of them in most.

    Parameters
    ----------
    kind : EventKind
        What happened.
    snr_db : float
        Activation ratio omega^2/rho in dB that was compared with the threshold.
    threshold_db : float
        That threshold.
    component_id : int
        Identity of the object component; -1 for bursts, channel components, rejected candidates.
    beat, doppler : float
        Where an object is or was; NaN otherwise.
    ramp : int
        Ramp of a burst or channel component; -1 for objects.
    bin : int
        Grid bin of a channel component; -1 otherwise.
    """

    kind: EventKind
    snr_db: float
    threshold_db: float
    component_id: int = -1
    beat: float = float("nan")
    doppler: float = float("nan")
    ramp: int = -1
    bin: int = -1


@dataclass(frozen=True, kw_only=True, slots=True)
class IterationInfo:
    """Diagnostics of one step.

    Parameters
    ----------
    elbo : float
        Evidence lower bound (19) up to the constants of the improper priors, in nats.
    events : tuple of ComponentEvent
        In the order in which they happened.
    max_frequency_change : float
        Largest move of an object's beat or Doppler frequency, in standard deviations of an
        isolated line of its SNR.
    noise_precision_change : float
        Relative change of lambda.
    searched : bool
        Whether every ramp was searched for bursts at the beginning of this step, or at its end
        without finding anything.
    separability_ratio_db : float
        Condition (27): ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||, in dB (20 log10); NaN while
        there is no object or no interference.
    """

    elbo: float
    events: tuple[ComponentEvent, ...]
    max_frequency_change: float
    noise_precision_change: float
    searched: bool
    separability_ratio_db: float


class Termination(enum.Enum):
    """Why a run goes on or has ended; the value is what a user reads."""

    RUNNING = "running"
    CONVERGED = "converged: nothing added or removed, no object moved, the noise is steady"
    MAX_ITERATIONS = "stopped at the largest number of iterations; raise max_iterations to go on"
    NONFINITE = "stopped: a value became infinite or undefined; the last good state is kept"


@dataclass(frozen=True, kw_only=True, slots=True, weakref_slot=True, eq=False)
class Step:
    """One iteration as the runner yields it; its seconds are measured outside of the algorithm."""

    state: SeparationState
    info: IterationInfo
    termination: Termination
    seconds: float
    seconds_by_part: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Solution:
    """Outcome of a whole run."""

    state: SeparationState
    termination: Termination
    infos: tuple[IterationInfo, ...]
    seconds: float
    seconds_by_part: Mapping[str, float] = field(default_factory=dict)

    @property
    def objects(self) -> ObjectComponents:
        """The object components of the last state."""
        return self.state.objects

    @property
    def iterations(self) -> int:
        """Number of completed iterations."""
        return self.state.iteration
