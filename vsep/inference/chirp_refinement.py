"""How a burst moves: refinement of its start frequency and slope by climbing (71).

Gradient and curvature stand in `vsep.kernels.channel.template_slopes`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError

from vsep._arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.kernels.ramps import FlatRamps, all_costs, all_slopes, damped_steps
from vsep.signal.template import SignalModel

LONGEST_SHIFT = 0.1  # of the burst's length, one step
LONGEST_STRETCH = 0.1  # of the slope, one step
NO_GAIN = 1e-4  # nats of log evidence: a step that promises less is not tried
HALVINGS = 5  # times a step is cut to a quarter before it is given up


class ChirpCosts(Protocol):
    """Costs of the templates of some bursts, one each, to be climbed."""

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(T,) costs of T chosen bursts with other templates (T, N)."""

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs (T,), gradients (T, 2) and curvatures (T, 2, 2) for derivatives (T, 2, N)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ChannelCosts:
    """Costs (71) of R ramps: ``log|C| + lambda h^H beta``, by the template of one burst each.

    Parameters
    ----------
    ramps : FlatRamps
        Templates, bins and prior precisions of the ramps.
    moving : (R,) int
        Which burst of each ramp is changed.
    residual : (R, N) complex
        Received ramps minus the object estimate.
    noise_precision : float
        lambda.
    """

    ramps: FlatRamps
    moving: IntArray
    residual: ComplexArray
    noise_precision: float

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(T,) costs of T chosen ramps with other templates (T, N)."""
        return all_costs(
            self.ramps, self.moving, chosen, templates, self.residual, self.noise_precision
        )

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs, exact gradients and Gauss-Newton curvatures."""
        return all_slopes(
            self.ramps,
            self.moving,
            chosen,
            templates,
            derivatives,
            self.residual,
            self.noise_precision,
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SharedCosts:
    """Sums of costs over the rows that share a template: one burst as several antennas see it.

    Parameters
    ----------
    costs : ChirpCosts
        Of every row.
    owners : (R,) int
        Which of the shared templates each row has; -1 for none of them.
    """

    costs: ChirpCosts
    owners: IntArray

    def values(self, chosen: IntArray, templates: ComplexArray) -> FloatArray:
        """(T,) costs of T chosen bursts with other templates (T, N)."""
        rows, places = self._rows(chosen)
        values = self.costs.values(rows, templates[places])
        total = np.zeros(len(chosen))
        np.add.at(total, places, values)
        return total

    def slopes(
        self, chosen: IntArray, templates: ComplexArray, derivatives: ComplexArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs, gradients and curvatures, each a sum."""
        rows, places = self._rows(chosen)
        values, gradients, curvatures = self.costs.slopes(
            rows, templates[places], derivatives[places]
        )
        totals = np.zeros(len(chosen)), np.zeros((len(chosen), 2)), np.zeros((len(chosen), 2, 2))
        for total, each in zip(totals, (values, gradients, curvatures), strict=True):
            np.add.at(total, places, each)
        return totals

    def _rows(self, chosen: IntArray) -> tuple[IntArray, IntArray]:
        """Rows of the chosen bursts, and which of them each belongs to."""
        places = np.full(int(self.owners.max()) + 1, -1)
        places[chosen] = np.arange(len(chosen))
        rows = np.flatnonzero((self.owners >= 0) & (places[self.owners] >= 0))
        return rows, places[self.owners[rows]]


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
        """Return some of the bursts, as copies."""
        return PlacedChirps(
            self.start_frequency[places],
            self.slope[places],
            self.reference[places],
            self.templates[places],
            self.derivatives[places],
        )

    def with_others(self, places: IntArray, others: "PlacedChirps") -> "PlacedChirps":
        """Return these bursts with others inserted before some places."""
        return PlacedChirps(
            np.insert(self.start_frequency, places, others.start_frequency),
            np.insert(self.slope, places, others.slope),
            np.insert(self.reference, places, others.reference),
            np.insert(self.templates, places, others.templates, axis=0),
            np.insert(self.derivatives, places, others.derivatives, axis=0),
        )

    def put(self, places: IntArray, others: "PlacedChirps") -> None:
        """Overwrite some of the bursts."""
        self.start_frequency[places] = others.start_frequency
        self.slope[places] = others.slope
        self.reference[places] = others.reference
        self.templates[places] = others.templates
        self.derivatives[places] = others.derivatives


def place_chirps(
    start_frequency: FloatArray, slope: FloatArray, model: SignalModel
) -> PlacedChirps:
    """Templates of several pairs of parameters, (B,) each."""
    last = model.num_samples - 1.0
    reference = np.minimum(np.maximum(-start_frequency / slope, 0.0), last)
    jets = model.template_jet(start_frequency, slope, reference)
    return PlacedChirps(start_frequency, slope, reference, *jets)


def refine_chirps(
    chirps: PlacedChirps,
    places: IntArray,
    model: SignalModel,
    costs: ChirpCosts,
    *,
    max_steps: int = 1,
) -> PlacedChirps:
    """Climb costs in (frequency at the burst's centre, slope) by damped Gauss-Newton steps.

    Parameters
    ----------
    chirps : PlacedChirps
        Where B bursts start; no two in one ramp, whose costs would depend on each other.
    places : (B,) int
        By which numbers the costs know them.
    model : SignalModel
        Makes the templates, those of all trials in one call.
    costs : ChirpCosts
        What they climb.
    max_steps : int
        Steps at most.

    Returns
    -------
    PlacedChirps
        No cost falls.
    """
    refined = chirps.chosen(np.arange(len(chirps)))
    moving = np.arange(len(chirps))
    for _ in range(max_steps):
        if len(moving) == 0:
            break
        values, moves, promises = _damped_steps(
            refined.chosen(moving), places[moving], costs, model
        )
        worth = promises >= NO_GAIN
        trying, values, moves = moving[worth], values[worth], moves[worth]
        moved = np.zeros(len(refined), dtype=bool)
        for _ in range(HALVINGS):
            if len(trying) == 0:
                break
            trials = _moved(refined, trying, moves, model)
            better = costs.values(places[trying], trials.templates) >= values
            refined.put(trying[better], trials.chosen(better))
            moved[trying[better]] = True
            trying, values, moves = trying[~better], values[~better], 0.25 * moves[~better]
        moving = np.flatnonzero(moved)
    return refined


def _moved(
    chirps: PlacedChirps, chosen: IntArray, moves: FloatArray, model: SignalModel
) -> PlacedChirps:
    """Chosen chirps after moves (T, 2) of the frequency at the reference, and of the slope."""
    shift, stretch = moves.T
    start = chirps.start_frequency[chosen] + shift - stretch * chirps.reference[chosen]
    return place_chirps(start, chirps.slope[chosen] + stretch, model)


def _damped_steps(
    chirps: PlacedChirps, places: IntArray, costs: ChirpCosts, model: SignalModel
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Costs (T,), Gauss-Newton steps (T, 2) no longer than allowed, and what they promise (T,)."""
    values, gradients, curvatures = costs.slopes(places, chirps.templates, chirps.derivatives)
    if not np.isfinite(values).all():
        raise LinAlgError("the precision matrix of a ramp is not positive definite")
    longest = np.empty(gradients.shape)
    longest[:, 0] = 2.0 * LONGEST_SHIFT * model.normalised_cutoff
    longest[:, 1] = LONGEST_STRETCH * np.abs(chirps.slope)
    return values, *damped_steps(gradients, curvatures, longest)
