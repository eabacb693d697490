"""Frame of a step as each source sees it, with samples that count less where there are any.

Without weights the residuals are those of the paper. With weights W objects are updated on a
majorised frame, `vsep.inference.objects.masked`, and bursts on the frame with what is explained in
the place of what does not count.
"""

import math

import numpy as np

from vsep._typing import BoolArray, ComplexArray, IntArray
from vsep.inference.bursts.sample_weights import SampleWeights
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.object_only import expected_error

NEGLIGIBLE_SHARE = 0.03  # of a frame's information: what bursts may take without being counted
LEAST_SHARE = 0.1


class WeighedFrame:
    """A frame with the weights of its samples.

    Parameters
    ----------
    received : (P, N) complex
        The frame.
    state : SeparationState
        Where the step starts from.
    weights : SampleWeights or None
        None where every sample counts fully.
    """

    def __init__(
        self, received: ComplexArray, state: SeparationState, weights: SampleWeights | None
    ) -> None:
        self.received, self.weights = received, weights
        self._unexplained = state.unexplained_share
        self.used = received
        if weights is not None:
            self.used = weights.fitted(received, state.object_signal + state.interference_signal)

    @property
    def num_used(self) -> int:
        """Samples that tell of the noise level."""
        return self.received.size if self.weights is None else self.weights.num_counted

    def for_objects(self, object_signal: ComplexArray, bursts: ComplexArray) -> ComplexArray:
        """Return r_alpha, or Phi alpha + W (r - U Psi beta - Phi alpha)."""
        if self.weights is None:
            return self.used - bursts
        left = self.received - object_signal - bursts
        return object_signal + self.weights.values * left

    def for_bursts(self, object_signal: ComplexArray, bursts: ComplexArray) -> ComplexArray:
        """Return r_beta, or U Psi beta + W (r - U Psi beta - Phi alpha)."""
        if self.weights is None:
            return self.used - object_signal
        return bursts + self.weights.values * (self.received - object_signal - bursts)

    def noise_precision(
        self, object_signal: ComplexArray, bursts: ComplexArray, trace: float
    ) -> float:
        """Lambda from (65), of the samples that count.

        Parameters
        ----------
        object_signal, bursts : (P, N) complex
            Phi alpha and U Psi beta.
        trace : float
            Expected energy of the uncertainty of all weights.
        """
        left = self.received - object_signal - bursts
        if self.weights is None:
            return left.size * self._unexplained / expected_error(left, trace)
        counted = (np.sqrt(self.weights.values) * left)[self.weights.counted]
        num_counted = self.weights.num_counted * self._unexplained
        return num_counted / expected_error(counted, self.weights.share * trace)

    def share_for_objects(
        self, interference: InterferenceWorkspace, noise_precision: float
    ) -> float:
        """Share of the frame's information that is left for the objects.

        What the bursts are fitted with, lambda tr(U Psi C Psi^H U^H) weights and a pair of real
        parameters each, explains as much of the noise, and of every object that is not modelled.
        """
        fitted = noise_precision * interference.trace + len(interference.table)
        lost = fitted / math.prod(self.received.shape)
        if self.weights is None:
            return 1.0 if lost < NEGLIGIBLE_SHARE else max(1.0 - lost, LEAST_SHARE)
        return max(self.weights.share - lost, LEAST_SHARE)


def rows_with_gaps(interfered: IntArray, *gaps: BoolArray | None) -> IntArray:
    """Return rows with bursts, and those (P, N) of samples that are missing or hold no chirps."""
    rows = [np.flatnonzero(each.any(axis=1)) for each in gaps if each is not None]
    return np.concatenate([interfered, *rows])
