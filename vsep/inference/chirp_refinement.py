"""How a burst moves: refinement of its start frequency and slope by climbing (71).

Gradient and curvature stand in `vsep.kernels.channel.template_slopes`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import LinAlgError

from vsep._arrays import ComplexArray, FloatArray, IntArray
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
        Which of the shared templates each row has.
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
        rows = np.flatnonzero(places[self.owners] >= 0)
        return rows, places[self.owners[rows]]


@dataclass(frozen=True, slots=True, eq=False)
class PlacedChirp:
    """Start frequency and slope (normalised) with what they imply.

    Attributes
    ----------
    start_frequency, slope : float
        Cycles per sample and cycles per sample squared.
    reference : float
        The sample of the ramp next to the burst's centre.
    template : (N,) complex
    derivatives : (2, N) complex
        By the frequency at the reference, and by the slope.
    """

    start_frequency: float
    slope: float
    reference: float
    template: ComplexArray
    derivatives: ComplexArray

    @property
    def place(self) -> tuple[float, float, float]:
        """Start frequency, slope and reference."""
        return self.start_frequency, self.slope, self.reference


def place_chirps(
    start_frequency: FloatArray, slope: FloatArray, model: SignalModel
) -> list[PlacedChirp]:
    """Templates of several pairs of parameters, (B,) each."""
    last = model.num_samples - 1.0
    reference = np.minimum(np.maximum(-start_frequency / slope, 0.0), last)
    jets = model.template_jet(start_frequency, slope, reference)
    parameters = start_frequency.tolist(), slope.tolist(), reference.tolist()
    return [PlacedChirp(*each) for each in zip(*parameters, *jets, strict=True)]


def place_chirp(start_frequency: float, slope: float, model: SignalModel) -> PlacedChirp:
    """Template of one pair of parameters."""
    reference = min(max(-start_frequency / slope, 0.0), model.num_samples - 1.0)
    jet = model.template_jet(start_frequency, slope, reference)
    return PlacedChirp(start_frequency, slope, reference, *jet)


def refine_chirps(
    chirps: Sequence[PlacedChirp],
    model: SignalModel,
    costs: ChirpCosts,
    *,
    max_steps: int = 1,
) -> list[PlacedChirp]:
    """Climb costs in (frequency at the burst's centre, slope) by damped Gauss-Newton steps.

    Parameters
    ----------
    chirps : sequence of PlacedChirp
        Where to start; no two in one ramp, whose costs would depend on each other.
    model : SignalModel
        Makes the templates, those of all trials in one call.
    costs : ChirpCosts
        What they climb.
    max_steps : int
        Steps at most.

    Returns
    -------
    list of PlacedChirp
        No cost falls.
    """
    refined = list(chirps)
    moving = np.arange(len(refined))
    for _ in range(max_steps):
        if len(moving) == 0:
            break
        values, moves = np.empty(len(refined)), np.empty((len(refined), 2))
        values[moving], moves[moving], promises = _damped_steps(refined, moving, costs, model)
        trying = moving[promises >= NO_GAIN]
        moved = []
        for halving in range(HALVINGS):
            if len(trying) == 0:
                break
            shifts, stretches = moves[trying].T * 0.25**halving
            start, slope, reference = np.array([refined[index].place for index in trying]).T
            trials = place_chirps(start + shifts - stretches * reference, slope + stretches, model)
            found = costs.values(trying, np.array([trial.template for trial in trials]))
            better = found >= values[trying]
            for number in np.flatnonzero(better):
                refined[trying[number]] = trials[number]
            moved.append(trying[better])
            trying = trying[~better]
        moving = np.sort(np.concatenate(moved)) if moved else trying
    return refined


def _damped_steps(
    chirps: Sequence[PlacedChirp], chosen: IntArray, costs: ChirpCosts, model: SignalModel
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Costs (T,), Gauss-Newton steps (T, 2) no longer than allowed, and what they promise (T,)."""
    moving = [chirps[index] for index in chosen]
    values, gradients, curvatures = costs.slopes(
        chosen,
        np.array([chirp.template for chirp in moving]),
        np.array([chirp.derivatives for chirp in moving]),
    )
    if not np.all(np.isfinite(values)):
        raise LinAlgError("the precision matrix of a ramp is not positive definite")
    longest = np.array(
        [
            (2.0 * LONGEST_SHIFT * model.normalised_cutoff, LONGEST_STRETCH * abs(chirp.slope))
            for chirp in moving
        ]
    )
    return values, *damped_steps(gradients, curvatures, longest)
