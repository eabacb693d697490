"""Masked estimator: objects alone, from the samples that are not interfered.

It is `ObjectOnlySeparator` told which samples to ignore; nothing is put in their place. With the
diagonal mask M of the used samples the mean of the weights solves

    lambda Phi^H M (r - Phi alpha) = Gamma alpha .

Phi^H M Phi has no structure to exploit. Every step therefore works on a whole frame that has the
same gradient, ``r' = Phi alpha + w M (r - Phi alpha)`` with noise precision ``lambda / w``: a
majorisation step (w = 1 is expectation-maximisation, the prediction in place of the missing
samples), made longer. With w = PN / (number of used samples) atoms keep their norm on the used
samples on average, so that covariances, thresholds and standard deviations account for what is
missing. Any w < 2 converges, as the eigenvalues of M are 0 and 1.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray, frozen
from vsep.errors import InputError
from vsep.inference.core.estimator import EstimatorEntry, is_quiet, require_one_antenna, settle
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.object_only import ObjectSettings, step_on_used


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class MaskedSeparator(ObjectSettings):
    """Algorithm 3 on the samples that are not flagged.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter (which plays no part here).
    mask : (P, N) bool or None
        True where a sample is interfered and to be ignored; None uses all.
    false_alarm_rate, object_threshold_db, max_iterations, missing
        As for `ObjectOnlySeparator`.
    """

    mask: BoolArray | None = None

    def __post_init__(self) -> None:
        """Check the settings."""
        require_one_antenna(self.model, "masked")
        ObjectSettings.__post_init__(self)
        mask = np.zeros(self.model.shape, np.bool_) if self.mask is None else np.array(self.mask)
        if mask.shape != self.model.shape or mask.dtype != np.bool_:
            raise InputError(
                f"The mask has shape {mask.shape} and type {mask.dtype}; it must be boolean, "
                f"{self.model.shape}."
            )
        if np.count_nonzero(~mask) < 2:
            raise InputError(
                f"The mask flags all but {np.count_nonzero(~mask)} of {mask.size} samples; at "
                "least 2 must be usable."
            )
        object.__setattr__(self, "mask", frozen(mask))

    @property
    def used(self) -> BoolArray:
        """(P, N) True where a sample is used."""
        assert self.mask is not None  # set in __post_init__
        return ~self.mask if self.missing is None else ~(self.mask | self.missing)

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step; see `ObjectOnlySeparator.init`.

        Raises
        ------
        InputError
            If the frame cannot be used, or is zero wherever it is not flagged.
        """
        received = self.model.check(received)
        used = received[self.used]
        energy = float(np.sum(np.abs(used) ** 2))
        if energy == 0.0:
            raise InputError("received is zero at every sample that is not flagged.")
        state = ObjectSettings.init(self, received)
        return replace(
            state,
            noise_precision=2.0 * (used.size - 1) / energy,
            used_share=used.size / received.size,
        )

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One iteration of Algorithm 3 on a whole frame with the gradient of the used samples."""
        new_state, info = step_on_used(self, received, state, self.used)
        flagged = ~self.used
        if self.missing is not None:
            flagged = flagged & ~self.missing
        difference = state.corrected(received) - new_state.object_signal
        return replace(new_state, interference_signal=np.where(flagged, difference, 0.0)), info

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when nothing happened, nothing moved and lambda is steady."""
        return settle(state, self.max_iterations, converged=is_quiet(info))


ENTRIES = (
    EstimatorEntry(
        name="masked",
        label="Masked",
        help="Algorithm 3 on the samples that a mask leaves: interfered ones are ignored.",
        factory=MaskedSeparator,
        position=40,
    ),
)
