"""Gauss-Newton refinement of chirp parameters, (71).

Gradient and curvature stand in `vsep.kernels.channel.template_slopes`.
"""

import math
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.kernels.gauss_newton import gauss_newton_steps
from vsep.kernels.ramps import FlatRamps, all_costs, all_slopes
from vsep.signal.template import SignalModel

MAX_SHIFT = 0.1  # of the burst's length, one step
MAX_STRETCH = 0.1  # of the slope, one step
NO_GAIN = 1e-4  # nats of log evidence: a step that promises less is not tried
HALVINGS = 5  # times a step is cut to a quarter before it is given up


class ChirpCosts(Protocol):
    """Costs of the templates of some bursts, one each, to be maximised."""

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(T,) costs of T chosen bursts with other templates (T, N)."""

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs (T,), gradients (T, 2) and curvatures (T, 2, 2) for derivatives (T, 2, N)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ChannelCosts:
    """Costs (71): ``log|C| + lambda h^H beta``, by the template of one burst of each of some ramps.

    Parameters
    ----------
    ramps : FlatRamps
        Templates, bins and prior precisions of R ramps.
    moving : (R,) int
        Which burst of each ramp is changed.
    shared : (R,) int
        Which of the S refined bursts it is, -1 for none. One burst as several antennas see it lies
        in as many ramps, whose costs are summed.
    residual : (R, N) complex
        Received ramps minus the object estimate.
    noise_precision : float
        lambda.
    """

    ramps: FlatRamps
    moving: IntArray
    shared: IntArray
    residual: ComplexArray
    noise_precision: float

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(T,) costs of T chosen bursts with other templates (T, N)."""
        return all_costs(
            self.ramps,
            self.moving,
            self.shared,
            chosen,
            templates,
            self.residual,
            self.noise_precision,
        )

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs, exact gradients and Gauss-Newton curvatures."""
        return all_slopes(
            self.ramps,
            self.moving,
            self.shared,
            chosen,
            templates,
            derivatives,
            self.residual,
            self.noise_precision,
        )


@dataclass(frozen=True, slots=True, eq=False)
class PlacedChirps:
    """Start frequencies and slopes (normalised) of B bursts with what they imply.

    Attributes
    ----------
    start_frequency, slope : (B,) float
        Cycles per sample and cycles per sample squared.
    reference : (B,) float
        The sample of the ramp next to the burst's centre.
    templates : (B, N) complex
    derivatives : (B, 2, N) complex
        By the frequency at the reference, and by the slope.
    """

    start_frequency: FloatArray
    slope: FloatArray
    reference: FloatArray
    templates: ComplexArray
    derivatives: ComplexArray

    def __len__(self) -> int:
        """Return the number of bursts."""
        return len(self.slope)

    def chosen(self, places: IntArray | BoolArray) -> "PlacedChirps":
        """Return any of the bursts."""
        return PlacedChirps(
            self.start_frequency[places],
            self.slope[places],
            self.reference[places],
            self.templates[places],
            self.derivatives[places],
        )

    def some(self, places: IntArray) -> "PlacedChirps":
        """Return some of the bursts, given in ascending order; these themselves if it is all."""
        return self if len(places) == len(self.slope) else self.chosen(places)

    def with_others(self, places: IntArray, others: "PlacedChirps") -> "PlacedChirps":
        """Return these bursts with others inserted before some places."""
        return PlacedChirps(
            np.insert(self.start_frequency, places, others.start_frequency),
            np.insert(self.slope, places, others.slope),
            np.insert(self.reference, places, others.reference),
            np.insert(self.templates, places, others.templates, axis=0),
            np.insert(self.derivatives, places, others.derivatives, axis=0),
        )

    def replaced(self, places: IntArray, others: "PlacedChirps") -> "PlacedChirps":
        """Return these bursts with others in place of some, given in ascending order."""
        if len(places) == len(self.slope):
            return others
        arrays = {each.name: getattr(self, each.name).copy() for each in fields(self)}
        for name, values in arrays.items():
            values[places] = getattr(others, name)
        return PlacedChirps(**arrays)


def place_chirps(
    start_frequency: FloatArray, slope: FloatArray, model: SignalModel
) -> PlacedChirps:
    """Templates of several pairs of parameters, (B,) each."""
    last = model.num_samples - 1.0
    # At the burst's centre frequency and slope are least correlated.
    reference = np.minimum(np.maximum(-start_frequency / slope, 0.0), last)
    jets = model.template_jets(start_frequency, slope, reference)
    return PlacedChirps(start_frequency, slope, reference, *jets)


def refine_chirps(
    chirps: PlacedChirps,
    model: SignalModel,
    costs: ChirpCosts,
    *,
    max_steps: int = 1,
    least_gain: float = NO_GAIN,
) -> PlacedChirps:
    """Maximise costs in (frequency at the burst's centre, slope) by damped Gauss-Newton steps.

    Parameters
    ----------
    chirps : PlacedChirps
        Where bursts start; no two in one ramp, whose costs would depend on each other.
    model : SignalModel
        Makes the templates, those of all trials in one call.
    costs : ChirpCosts
        What is maximised.
    max_steps : int
        Steps at most.
    least_gain : float
        Nats that a step must promise to be tried.

    Returns
    -------
    PlacedChirps
        No cost falls.
    """
    refined, moving = chirps, np.arange(len(chirps.slope))
    # Trust region: a tenth of the burst's length, a tenth of the slope
    longest = 2.0 * MAX_SHIFT * model.normalised_cutoff, MAX_STRETCH
    for _ in range(max_steps):
        present = refined.some(moving)
        # (71), its gradient and Fisher information
        values, gradients, curvatures = costs.slopes(moving, present.templates, present.derivatives)
        if not math.isfinite(values.sum()):
            raise LinAlgError("the precision matrix of a ramp is not positive definite")
        steps, promises = gauss_newton_steps(gradients, curvatures, present.slope, longest)
        # Bursts whose quadratic model promises a gain try their step, a quarter of it, and so on.
        trying = (promises >= least_gain).nonzero()[0]
        if len(trying) == 0:
            break
        still = np.zeros(len(moving), dtype=bool)
        for _ in range(HALVINGS):
            if len(trying) == 0:
                break
            trials = _moved(present.some(trying), steps[trying], model)
            # the log evidence never falls
            better = costs.values(moving[trying], trials.templates) >= values[trying]
            winners = better.nonzero()[0]
            still[trying[winners]] = True
            refined = refined.replaced(moving[trying[winners]], trials.some(winners))
            trying = trying[~better]
            steps *= 0.25
        # Bursts that gained go on.
        moving = moving[still]
        if len(moving) == 0:
            break
    return refined


def _moved(chirps: PlacedChirps, steps: FloatArray, model: SignalModel) -> PlacedChirps:
    """Place chirps after steps (T, 2) of the frequency at the reference, and of the slope."""
    stretch = steps[:, 1]
    # Frequency at sample 0 from that at the reference
    start = chirps.start_frequency + steps[:, 0] - stretch * chirps.reference
    return place_chirps(start, chirps.slope + stretch, model)
