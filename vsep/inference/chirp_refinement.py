"""How a burst moves: refinement of its start frequency and slope by climbing (71).

Gradient and curvature stand in `vsep.kernels.channel.template_slopes`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import LinAlgError

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.channel import Channel, channel_cost, channel_slopes
from vsep.signal.template import SignalModel

RIDGE = 1e-9  # relative, keeps the Newton step finite where the channel absorbs a parameter
LONGEST_SHIFT = 0.1  # of the burst's length, one step
LONGEST_STRETCH = 0.1  # of the slope, one step
NO_GAIN = 1e-4  # nats of log evidence: a step that promises less is not tried
HALVINGS = 5  # times a step is cut to a quarter before it is given up


class ChirpCost(Protocol):
    """A cost of one ramp's template, to be climbed."""

    def value(self, template: ComplexArray) -> float:
        """Cost of a template (N,)."""

    def slopes(
        self, template: ComplexArray, derivatives: ComplexArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Cost, gradient (2,) and curvature (2, 2) for the template's derivatives (2, N)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ChannelCost:
    """Cost (71) of a ramp: ``log|C| + lambda h^H beta``, as a function of one burst's template.

    Parameters
    ----------
    residual : (N,) complex
        Received ramp minus the object estimate.
    templates : (B, N) complex
        Templates of all bursts of the ramp.
    moving : int
        Which of them is changed.
    channel : Channel
        Burst, bin and prior precision of every column, held fixed.
    noise_precision : float
        lambda.
    """

    residual: ComplexArray
    templates: ComplexArray
    moving: int
    channel: Channel
    noise_precision: float

    def _templates(self, template: ComplexArray) -> ComplexArray:
        if len(self.templates) == 1:
            return template[None]
        templates = self.templates.copy()
        templates[self.moving] = template
        return templates

    def value(self, template: ComplexArray) -> float:
        """Cost of a template (N,)."""
        templates = self._templates(template)
        return channel_cost(templates, self.residual, self.channel, self.noise_precision)

    def slopes(
        self, template: ComplexArray, derivatives: ComplexArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Cost, exact gradient and Gauss-Newton curvature."""
        return channel_slopes(
            self._templates(template),
            self.moving,
            derivatives,
            self.residual,
            self.channel,
            self.noise_precision,
        )


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
    costs: Sequence[ChirpCost],
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
    costs : sequence of ChirpCost
        What each of them climbs.
    max_steps : int
        Steps at most.

    Returns
    -------
    list of PlacedChirp
        No cost falls.
    """
    refined = list(chirps)
    moving = list(range(len(refined)))
    for _ in range(max_steps):
        found = {index: _damped_step(refined[index], costs[index], model) for index in moving}
        steps = {index: step for index, step in found.items() if step is not None}
        trying = list(steps)
        moving, scale = [], 1.0
        for _ in range(HALVINGS):
            if not trying:
                break
            moves = np.array([steps[index].move for index in trying]).T * scale
            start, slope, reference = np.array([refined[index].place for index in trying]).T
            trials = place_chirps(start + moves[0] - moves[1] * reference, slope + moves[1], model)
            failed = []
            for index, trial in zip(trying, trials, strict=True):
                if costs[index].value(trial.template) >= steps[index].value:
                    refined[index] = trial
                    moving.append(index)
                else:
                    failed.append(index)
            trying, scale = failed, 0.25 * scale
    return refined


class _Step(NamedTuple):
    """Cost where a chirp is, and the moves of its central frequency and of its slope to try."""

    value: float
    move: tuple[float, float]


def _damped_step(chirp: PlacedChirp, cost: ChirpCost, model: SignalModel) -> _Step | None:
    """Gauss-Newton step, no longer than allowed; None if it promises nothing."""
    value, gradient, curvature = cost.slopes(chirp.template, chirp.derivatives)
    if not math.isfinite(value):
        raise LinAlgError("the precision matrix of a ramp is not positive definite")
    shift, stretch = newton_step(gradient, curvature)
    scale = 1.0 / max(
        1.0,
        abs(shift) / (2.0 * LONGEST_SHIFT * model.normalised_cutoff),
        abs(stretch) / (LONGEST_STRETCH * abs(chirp.slope)),
    )
    if scale * (gradient[0] * shift + gradient[1] * stretch) < 2.0 * NO_GAIN:
        return None
    return _Step(value, (scale * shift, scale * stretch))


def newton_step(gradient: FloatArray, curvature: FloatArray) -> tuple[float, float]:
    """Solve for the two steps with a curvature (2, 2) that is ridged, by Cramer's rule.

    Without any curvature, as of a burst that has left the band, there is no step.
    """
    (first, mixed), (_, second) = curvature.tolist()
    first, second = (1.0 + RIDGE) * first, (1.0 + RIDGE) * second
    by_frequency, by_slope = gradient.tolist()
    determinant = first * second - mixed**2
    if determinant == 0.0:
        return 0.0, 0.0
    return (
        (second * by_frequency - mixed * by_slope) / determinant,
        (first * by_slope - mixed * by_frequency) / determinant,
    )
