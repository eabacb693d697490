"""Separation, or the objects of the samples that no burst reaches: whichever has more evidence.

Where the model of a burst fits badly, what is left under it costs weak objects more than leaving
its samples out does. After a separation has ended, the objects alone are estimated once more, from
the samples that its bursts do not reach and that count fully, beginning with the objects found. Of
both estimates the one whose objects have more evidence on those samples is kept, see
`vsep.inference.objects.evidence`; the separation where there are next to none, or none else.
"""

import enum
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy import ndimage

from vsep._typing import BoolArray, ComplexArray, frozen
from vsep.inference.bursts.sample_weights import AVERAGED, COUNTED
from vsep.inference.calmness import CALM_ITERATIONS, calm_iterations
from vsep.inference.core.estimator import EstimatorEntry
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.schedule import ROBUST
from vsep.inference.core.state import SeparationState
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.evidence import evidence_of_places
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.parameters import PARAMETERS

REACHED = 0.25  # times the noise: mean power of a burst where its samples are left out
MOST_ITERATIONS = int(PARAMETERS["max_iterations"].bounds[1])
LEAST_USED = 0.02  # of the samples: fewer do not tell of the objects


class Choice(enum.Enum):
    """What was kept; the value is what a user reads."""

    SEPARATION = "separation"
    MASKING = "masking"


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ChoiceState(SeparationState):
    """State from the end of the separation on.

    Parameters
    ----------
    separated : SeparationState or None
        The end of the separation; None once the choice is made.
    ended : Termination
        How what is kept has ended.
    choice : Choice or None
        None while the objects alone are being estimated.
    evidence_nats : float
        By which the separation's objects exceed the others; NaN before.
    """

    separated: SeparationState | None
    ended: Termination
    choice: Choice | None = None
    evidence_nats: float = float("nan")


@dataclass(frozen=True, kw_only=True, slots=True)
class EvidenceChosenSeparator(FactorisedSeparator):
    """Algorithm 1, then Algorithm 3 without what bursts reach; the evidence chooses.

    Settings as `FactorisedSeparator`; ``max_iterations`` holds for each of both.
    """

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One iteration of the separation, or of the objects alone after its end."""
        if isinstance(state, ChoiceState) and state.separated is not None:
            return self._masked_step(received, state, state.separated)
        new_state, info = FactorisedSeparator.step(self, received, _plain(state))
        ended = FactorisedSeparator.terminate(self, new_state, info)
        if ended is Termination.RUNNING:
            return new_state, info
        used = self._used(new_state)
        present = np.ones_like(used) if self.missing is None else ~self.missing
        least = used.reshape(self.model.num_antennas, -1).mean(axis=1).min()
        if np.array_equal(used, present) or least < LEAST_USED:
            return _chosen(new_state, Choice.SEPARATION, ended), info
        aside = replace(
            new_state,
            used_share=float(used.mean()),
            sample_weights=frozen(used.astype(float)),
            calm_iterations=0,
        )
        return ChoiceState(**_values(aside), separated=new_state, ended=ended), info

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """End of what is kept, once the choice is made."""
        if not isinstance(state, ChoiceState):
            return FactorisedSeparator.terminate(self, state, info)
        return Termination.RUNNING if state.choice is None else state.ended

    def _used(self, state: SeparationState) -> BoolArray:
        """Return (A P, N) samples that no burst reaches and that count fully."""
        signal = state.interference_signal
        power = ndimage.uniform_filter1d(signal.real**2 + signal.imag**2, AVERAGED, axis=1)
        used = power * state.noise_precision <= REACHED
        if state.sample_weights is not None:
            used &= state.sample_weights > COUNTED
        return np.asarray(used)

    def _masked_step(
        self, received: ComplexArray, state: ChoiceState, separated: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        assert state.sample_weights is not None
        used = state.sample_weights > COUNTED
        masked = ObjectOnlySeparator(
            model=self.model,
            false_alarm_rate=self.false_alarm_rate,
            object_threshold_db=self.object_threshold_db,
            max_iterations=min(separated.iteration + self.max_iterations, MOST_ITERATIONS),
            missing=~used,
        )
        new_state, info = masked.step(received, state)
        calm = calm_iterations(ROBUST, state, info, new_state.objects, self.model)
        new_state = replace(new_state, calm_iterations=calm)
        ended = masked.terminate(new_state, info)
        if calm >= CALM_ITERATIONS:
            ended = Termination.CONVERGED
        if ended is Termination.RUNNING:
            return new_state, info
        rivals = (separated, new_state)
        scores = [
            evidence_of_places(
                rival.objects,
                rival.corrected(received),
                used,
                self.model,
                min(1.0, state.used_share / rival.used_share),
            )
            for rival in rivals
        ]
        gain = scores[0] - scores[1]
        if gain >= 0.0:
            kept = replace(separated, iteration=new_state.iteration)
            return _chosen(kept, Choice.SEPARATION, state.ended, gain), info
        return _chosen(_plain(new_state), Choice.MASKING, ended, gain), info


def _chosen(
    state: SeparationState, choice: Choice, ended: Termination, gain: float = float("nan")
) -> ChoiceState:
    return ChoiceState(
        **_values(state), separated=None, ended=ended, choice=choice, evidence_nats=gain
    )


def _plain(state: SeparationState) -> SeparationState:
    return SeparationState(**_values(state)) if isinstance(state, ChoiceState) else state


def _values(state: SeparationState) -> dict[str, Any]:
    return {each.name: getattr(state, each.name) for each in fields(SeparationState)}


ENTRIES = (
    EstimatorEntry(
        name="evidence",
        label="By evidence",
        help="Separation, or the objects without the samples that bursts reach: what has more "
        "evidence.",
        factory=EvidenceChosenSeparator,
        position=50,
        several_antennas=True,
        in_every_study=False,  # it is the factorised one wherever its model holds
    ),
)
