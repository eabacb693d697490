"""How a burst moves: refinement of its start frequency and slope by climbing (71).

With ``y = Psi beta`` and ``c = diag(Psi C Psi^H)`` the gradient of (71) is
``2 lambda Re sum da (r* y - a* (|y|^2 + c))`` over the derivatives da of the template. The
curvature is that of the residual after projection on the channel, which is positive definite.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.inference.channel import ChannelGrid, channel_posterior
from vsep.inference.sbl import ActiveSet
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
    grid : ChannelGrid
        The channel grid.
    residual : (N,) complex
        Received ramp minus the object estimate.
    templates : (B, N) complex
        Templates of all bursts of the ramp.
    moving : int
        Which of them is changed.
    owners, bins, precisions : (K,) arrays
        Burst, bin and prior precision of every column, held fixed.
    noise_precision : float
        lambda.
    """

    grid: ChannelGrid
    residual: ComplexArray
    templates: ComplexArray
    moving: int
    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    noise_precision: float

    def _templates(self, template: ComplexArray) -> ComplexArray:
        templates = self.templates.copy()
        templates[self.moving] = template
        return templates

    def _posterior(self, templates: ComplexArray) -> ActiveSet:
        return channel_posterior(
            self.grid,
            templates,
            self.residual,
            self.owners,
            self.bins,
            self.precisions,
            self.noise_precision,
        )

    def value(self, template: ComplexArray) -> float:
        """Cost of a template (N,)."""
        return self._posterior(self._templates(template)).cost()

    def slopes(
        self, template: ComplexArray, derivatives: ComplexArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """Cost, exact gradient and Gauss-Newton curvature."""
        templates = self._templates(template)
        active = self._posterior(templates)
        atoms, own = self.grid.atoms(self.bins), np.flatnonzero(self.owners == self.moving)
        gradient, curvature = template_slopes(
            derivatives, atoms[:, own], templates[self.owners].T * atoms, active, own, self.residual
        )
        return active.cost(), gradient, curvature


def template_slopes(
    derivatives: ComplexArray,
    atoms: ComplexArray,
    columns: ComplexArray,
    active: ActiveSet,
    moving: IntArray,
    residual: ComplexArray,
) -> tuple[FloatArray, FloatArray]:
    """Gradient (2,) and Gauss-Newton curvature (2, 2) of a log evidence by a template.

    Parameters
    ----------
    derivatives : (2, N) complex
        Derivatives of the template by the two parameters.
    atoms : (N, K) complex
        Channel atoms Psi of the columns that carry the template.
    columns : (N, M) complex
        All columns that have a part in this ramp.
    active : ActiveSet
        Posterior of the M columns.
    moving : (K,) int
        Which of them carry the template.
    residual : (N,) complex
        What the columns explain.
    """
    noise_precision = active.noise_precision
    line = atoms @ active.amplitudes[moving]
    rest = residual - columns @ active.amplitudes
    uncertainty = np.einsum("nk,nk->n", columns @ active.covariance[:, moving], atoms.conj())
    pull = rest.conj() * line - uncertainty.conj()
    gradient = 2.0 * noise_precision * (derivatives @ pull).real
    moved = derivatives * line
    crossed = moved @ columns.conj()
    curvature = (moved @ moved.conj().T).real
    curvature -= noise_precision * (crossed @ active.covariance.T @ crossed.conj().T).real
    return gradient, 2.0 * noise_precision * curvature


@dataclass(frozen=True, slots=True, eq=False)
class PlacedChirp:
    """Start frequency and slope (normalised) with the template (N,) they imply."""

    start_frequency: float
    slope: float
    template: ComplexArray


def place_chirp(start_frequency: float, slope: float, model: SignalModel) -> PlacedChirp:
    """Template of one pair of parameters."""
    template = model.template(np.array([start_frequency]), np.array([slope]))[0]
    return PlacedChirp(float(start_frequency), float(slope), template)


def refine_chirp(
    chirp: PlacedChirp, model: SignalModel, cost: ChirpCost, *, max_steps: int = 1
) -> PlacedChirp:
    """Climb a cost in (frequency at the burst's centre, slope) by damped Gauss-Newton steps.

    Parameters
    ----------
    chirp : PlacedChirp
        Where to start.
    model : SignalModel
        Makes the templates.
    cost : ChirpCost
        What is climbed.
    max_steps : int
        Steps at most.

    Returns
    -------
    PlacedChirp
        The cost never falls.
    """
    for _ in range(max_steps):
        start_frequency, slope = chirp.start_frequency, chirp.slope
        centre = -start_frequency / slope
        reference = float(np.clip(centre, 0.0, model.num_samples - 1.0))
        template, derivatives = model.template_jet(start_frequency, slope, reference)
        value, gradient, curvature = cost.slopes(template, derivatives)
        ridge = np.diag(RIDGE * np.diagonal(curvature))
        step = np.linalg.solve(curvature + ridge, gradient)
        step /= max(
            1.0,
            abs(step[0]) / (2.0 * LONGEST_SHIFT * model.normalised_cutoff),
            abs(step[1]) / (LONGEST_STRETCH * abs(slope)),
        )
        if gradient @ step < 2.0 * NO_GAIN:
            break
        for _ in range(HALVINGS):
            trial = place_chirp(
                start_frequency + step[0] - step[1] * reference, slope + step[1], model
            )
            if cost.value(trial.template) >= value:
                chirp = trial
                break
            step = 0.25 * step
        else:
            break
    return chirp
