"""Fit of objects that are next to known places, all of them together.

The samples are read once, for the expansion of the frame around the places. Gauss-Newton steps on
the joint cost (67) of all places and the fixed points (77) of the prior precisions then cost as
much as there are objects, not samples.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf, dpotri

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.inference.core.estimator import SETTLED_DEVIATIONS, SETTLED_NOISE
from vsep.inference.core.progress import ComponentEvent, EventKind
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.objects.expansion import Expansion, expanded
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace
from vsep.kernels.object_cost import MIN_SCHUR
from vsep.signal.template import SignalModel
from vsep.units import to_db

REACH_CELLS = 0.06  # by which objects may move from where the frame was expanded
EXPANSIONS = 4  # at most, each from where the one before has led
DROWNED = 10.0  # times the noise that was known: there is more in the frame than its objects
LEFT_OUT_DEVIATIONS = 0.03  # that the terms left out may move an object by
ABSENT = 0.25  # of its threshold: an object that has less where it should be is not there
LARGE = 2**16  # objects times samples: with fewer, one by one is no slower
STEPS = 8  # of Gauss and Newton at most, on one expansion
RENEWED = 2  # steps with a Fisher information of their own; it changes with the weights only


@dataclass(frozen=True, slots=True, eq=False)
class NearbyFit:
    """Objects after the fit.

    Parameters
    ----------
    components : ObjectComponents
        Places, precisions and identities count; weights are those of the beginning.
    noise_precision : float
        lambda.
    last_change, max_frequency_change : float
        Of the last step and of all, see `vsep.kernels.convergence`.
    events : tuple of ComponentEvent
        Objects that were pruned.
    """

    components: ObjectComponents
    noise_precision: float
    last_change: float
    max_frequency_change: float
    events: tuple[ComponentEvent, ...]


def fit_nearby(
    components: ObjectComponents,
    frame: ComplexArray,
    noise_precision: float,
    threshold: ObjectThreshold,
    *,
    num_antennas: int = 1,
    estimates_noise: bool = True,
) -> NearbyFit | None:
    """Fit places and prior precisions of objects that are next to where they are.

    Parameters
    ----------
    components : ObjectComponents
        The objects. Those below the threshold are pruned.
    frame : (A P, N) complex
        Received signal minus what is not objects.
    noise_precision : float
        lambda, or where it begins.
    threshold : ObjectThreshold
        T_alpha, and the noise it is relative to.
    num_antennas : int
        A.
    estimates_noise : bool
        Whether lambda is estimated from what the objects leave.

    Returns
    -------
    NearbyFit or None
        None where objects are not next to where they were thought to be, or coincide, and where
        the frame holds much more than them.
    """
    sizes = np.array([frame.shape[1], len(frame) // num_antennas])
    energy = float(np.vdot(frame, frame).real)
    events: list[ComponentEvent] = []
    before = components
    for _ in range(EXPANSIONS):
        points = np.stack([components.beats, components.dopplers], axis=1)
        work = _Nearby(
            expanded(points, frame, num_antennas),
            components,
            noise_precision,
            energy=energy,
            num_noise=frame.size,
            estimates_noise=estimates_noise,
            sizes=sizes,
            events=events,
        )
        try:
            settled = work.run(threshold)
        except LinAlgError:
            return None
        components, noise_precision = work.components, work.noise_precision
        if settled:
            moved = _moved_cells(before, components, sizes) / _deviations(work.ratios)
            return NearbyFit(
                components,
                noise_precision,
                work.max_frequency_change,
                float(moved.max(initial=0.0)),
                tuple(events),
            )
    return None


def _moved_cells(before: ObjectComponents, after: ObjectComponents, sizes: IntArray) -> FloatArray:
    """(L,) resolution cells by which objects have moved; some may have gone meanwhile."""
    own = np.isin(before.component_ids, after.component_ids)
    beats, dopplers = after.beats - before.beats[own], after.dopplers - before.dopplers[own]
    cells = np.stack([beats - np.rint(beats), dopplers - np.rint(dopplers)], axis=1) * sizes
    return np.asarray(np.abs(cells).max(axis=1))


def nearby_workspace(
    state: SeparationState,
    residual: ComplexArray,
    model: SignalModel,
    threshold: ObjectThreshold,
    *,
    estimates_noise: bool,
) -> ObjectWorkspace | None:
    """Objects of a state, fitted to a residual next to where they are; None where that fails.

    Parameters
    ----------
    state : SeparationState
        With objects, lambda and the next identity.
    residual : (A P, N) complex
        Received signal minus what is not objects.
    model : SignalModel
        Size; its objects stay in their range cells.
    threshold : ObjectThreshold
        T_alpha, and the noise it is relative to.
    estimates_noise : bool
        See `fit_nearby`.
    """
    near = fit_nearby(
        state.objects,
        residual,
        state.noise_precision,
        threshold,
        num_antennas=model.num_antennas,
        estimates_noise=estimates_noise,
    )
    if near is None:
        return None
    work = ObjectWorkspace(
        near.components,
        residual,
        near.noise_precision,
        threshold=threshold,
        next_id=state.next_component_id,
        num_antennas=model.num_antennas,
    )
    # Where lambda is estimated too, this is a whole run.
    work.max_frequency_change = near.last_change if estimates_noise else near.max_frequency_change
    work.events.extend(near.events)
    return work


def pays_together(state: SeparationState, model: SignalModel) -> bool:
    """Whether objects that are nearby are fitted together faster than one by one."""
    size = state.objects.num_components * state.object_signal.size
    return model.is_stationary and size >= LARGE


def updated_nearby(
    residual: ComplexArray,
    state: SeparationState,
    model: SignalModel,
    threshold: ObjectThreshold,
    max_additions: int,
) -> ObjectWorkspace | None:
    """Run Algorithm 3 with all objects next to where they are; None where they are not.

    Those that are there are fitted together; where one is added, Algorithm 3 follows. Parameters
    as for `vsep.inference.objects.object_only.update_objects`.
    """
    work = nearby_workspace(state, residual, model, threshold, estimates_noise=False)
    if work is None:
        return None
    moved, _ = work.max_frequency_change, work.signal  # what is left is looked through with it
    work.add_components(max_additions)
    if work.next_id != state.next_component_id:
        work.update_components()
        work.max_frequency_change = max(moved, work.max_frequency_change)
    return work


class _Fit(NamedTuple):
    """Weights (K, A) of the objects where they are, and what moves them.

    ``slopes`` (axes K, K) are derivatives of the Gram matrix by the first atom's frequencies,
    ``pulls`` (axes K, A) those of the products; ``error`` is the denominator of (65).
    """

    slopes: FloatArray
    pulls: ComplexArray
    covariance: FloatArray
    weights: ComplexArray
    error: float


class _Nearby:
    """Objects and how far they have moved on one expansion."""

    def __init__(
        self,
        expansion: Expansion,
        components: ObjectComponents,
        noise_precision: float,
        *,
        energy: float,
        num_noise: int,
        estimates_noise: bool,
        sizes: IntArray,
        events: list[ComponentEvent],
    ) -> None:
        self.expansion, self.origin = expansion, components
        self.noise_precision, self.energy, self.num_noise = noise_precision, energy, num_noise
        self.events, self.sizes, self.axes = events, sizes, 2 if sizes[1] > 1 else 1
        self.precisions, self.estimates_noise = components.precisions, estimates_noise
        self.ratios = np.ones(components.num_components)
        self.moves = np.zeros((components.num_components, 2))
        self.max_frequency_change = 0.0
        self.factor: tuple[FloatArray, IntArray] | None = None  # of the Fisher information

    @property
    def components(self) -> ObjectComponents:
        """The objects where they are now."""
        beats, dopplers = self.moves.T
        return replace(
            self.origin,
            beats=(self.origin.beats + beats + 0.5) % 1.0 - 0.5,
            dopplers=(self.origin.dopplers + dopplers + 0.5) % 1.0 - 0.5,
            precisions=self.precisions,
        )

    def run(self, threshold: ObjectThreshold) -> bool:
        """Move, re-estimate and prune until nothing changes; False where the expansion ends."""
        moved = False
        for number in range(STEPS):
            if not len(self.moves):
                self.max_frequency_change, self.ratios = 0.0, np.zeros(0)
                if self.estimates_noise:
                    self.noise_precision = self.num_noise / self.energy
                return True
            fit, before = self._fitted(), self.noise_precision
            if number == 0 and fit.error * before > DROWNED * self.num_noise:
                raise LinAlgError("the frame holds much more than noise beside its objects")
            # Where nothing has moved yet, an object has less than it will have at its place.
            if self._pruned(fit, threshold, 1.0 if moved else ABSENT):
                continue
            if moved:
                self._update_precisions(fit, threshold)
            change = abs(self.noise_precision / before - 1.0)
            self._step(fit, renewed=number < RENEWED)
            if np.abs(self.moves * self.sizes).max() > REACH_CELLS:
                return False
            is_still = self.max_frequency_change < SETTLED_DEVIATIONS
            if moved and is_still and change < SETTLED_NOISE:
                return self._is_within_reach()
            moved = True
        return False

    def _is_within_reach(self) -> bool:
        """Whether what the expansion leaves out moves no object.

        With the ratio s, a lone object that has moved by m deviations is off by ``0.3 m^3 / s``.
        """
        moved = np.hypot(*(self.moves * self.sizes).T) / _deviations(self.ratios)
        return bool(np.all(0.3 * moved**3 < LEFT_OUT_DEVIATIONS * np.maximum(self.ratios, 1.0)))

    def _fitted(self) -> _Fit:
        """Fit the weights where the objects are now."""
        beats, dopplers = self.moves.T
        grams, products = self.expansion.grams, self.expansion.products
        b, d = beats[:, None] - beats, dopplers[:, None] - dopplers
        by_beat = grams[1] + grams[3] * b + grams[4] * d
        by_doppler = grams[2] + grams[4] * b + grams[5] * d
        gram = grams[0] + 0.5 * ((grams[1] + by_beat) * b + (grams[2] + by_doppler) * d)
        b, d = self.moves[:, :1], self.moves[:, 1:]
        along_beat = products[1] + b * products[3] + d * products[4]
        along_doppler = products[2] + b * products[4] + d * products[5]
        ours = products[0] + 0.5 * (
            b * (products[1] + along_beat) + d * (products[2] + along_doppler)
        )
        matrix = self.noise_precision * gram  # lambda Phi^H Phi + diag(gamma), (59)
        matrix[np.diag_indices(len(matrix))] += self.precisions
        factor, failed = dpotrf(matrix)
        if failed:
            raise LinAlgError(f"the precision matrix is not positive definite at row {failed}")
        upper, _ = dpotri(factor, overwrite_c=True)
        covariance = np.triu(upper) + np.triu(upper, 1).T
        weights = self.noise_precision * (covariance @ ours)  # (58)
        explained = 2.0 * float(np.vdot(weights, ours).real)
        power = float(np.vdot(weights, gram @ weights).real)
        trace = float(weights.shape[1] * np.vdot(gram, covariance))
        return _Fit(
            slopes=np.concatenate([by_beat, by_doppler][: self.axes]),
            pulls=np.concatenate([along_beat, along_doppler][: self.axes]),
            covariance=covariance,
            weights=weights,
            error=self.energy - explained + power + trace,
        )

    def _step(self, fit: _Fit, *, renewed: bool) -> None:
        """One Gauss-Newton step of all places, as `vsep.kernels.joint_slopes` has it."""
        count, axes = len(fit.weights), self.axes
        left = fit.pulls - fit.slopes @ fit.weights  # dphi^H (r - Phi alpha)
        every = np.tile(fit.weights, (axes, 1))
        spread = np.einsum("ij,ij->i", np.tile(fit.covariance, (axes, 1)), fit.slopes)
        pull = np.einsum("ia,ia->i", every.conj(), left).real - fit.weights.shape[1] * spread
        if renewed or self.factor is None:
            *factor, failed = dgetrf(self._information(fit), overwrite_a=True)
            if failed:
                raise LinAlgError("objects coincide")
            self.factor = tuple(factor)
        step, _ = dgetrs(*self.factor, 2.0 * self.noise_precision * pull)
        steps = np.zeros((count, 2))
        steps[:, :axes] = step.reshape(axes, count).T
        self.moves = self.moves + steps
        # largest_change of vsep.kernels.convergence
        self.ratios = self._ratios(fit)[0]
        cells = np.abs(steps * self.sizes).max(axis=1)
        self.max_frequency_change = float((cells / _deviations(self.ratios)).max())

    def _information(self, fit: _Fit) -> FloatArray:
        """F = 2 lambda Re{ sum_a alpha_i^* alpha_k dphi_i^H (I - lambda Phi C Phi^H) dphi_k }."""
        grams, size = self.expansion.grams, len(fit.slopes)
        curved = np.block([[grams[3], grams[4]], [grams[4], grams[5]]])[:size, :size]
        seen = curved + self.noise_precision * (fit.slopes @ fit.covariance @ fit.slopes.T)
        parts = np.concatenate([fit.weights.real, fit.weights.imag], axis=1)
        powers = np.tile(parts @ parts.T, (self.axes, self.axes))
        return np.asarray(-2.0 * self.noise_precision * powers * seen)

    def _ratios(self, fit: _Fit) -> tuple[FloatArray, FloatArray]:
        """Activation ratios omega^2 / rho, the antennas' sum, and 1/rho, (23)-(24)."""
        variances = np.diagonal(fit.covariance)
        inverse_rho = 1.0 / variances - self.precisions
        power = np.sum(fit.weights.real**2 + fit.weights.imag**2, axis=1)
        clear = inverse_rho > MIN_SCHUR * self.noise_precision
        ratios = power / (variances**2 * np.where(clear, inverse_rho, 1.0))
        return np.where(clear, ratios, 0.0), inverse_rho

    def _levels(self, threshold: ObjectThreshold) -> FloatArray:
        return threshold.kept_levels(self.components.beats, 2 * int(self.sizes[0]))

    def _update_precisions(self, fit: _Fit, threshold: ObjectThreshold) -> None:
        """Algorithm 4 for all objects at once, and lambda."""
        ratios, inverse_rho = self._ratios(fit)
        levels = self._levels(threshold)
        if self.estimates_noise:
            self.noise_precision = self.num_noise / fit.error  # (65)
        self.precisions = inverse_rho / (ratios / fit.weights.shape[1] - levels)  # (77)

    def _pruned(self, fit: _Fit, threshold: ObjectThreshold, share: float) -> bool:
        """Remove objects with less than a share of their threshold; whether there were any."""
        ratios = self._ratios(fit)[0] / self._levels(threshold)
        kept = ratios > share * threshold.ratio
        if kept.all():
            return False
        components = self.components
        for index in np.flatnonzero(~kept).tolist():
            self.events.append(
                ComponentEvent(
                    kind=EventKind.OBJECT_PRUNED,
                    snr_db=float(to_db(ratios[index])),
                    threshold_db=float(to_db(threshold.ratio)),
                    component_id=int(components.component_ids[index]),
                    beat=float(components.beats[index]),
                    doppler=float(components.dopplers[index]),
                )
            )
        self.origin, self.expansion = self.origin.chosen(kept), self.expansion.chosen(kept)
        self.moves, self.precisions, self.factor = self.moves[kept], self.precisions[kept], None
        return True


def _deviations(ratios: FloatArray) -> FloatArray:
    """Cramer-Rao bounds of isolated lines in resolution cells, by their activation ratios."""
    return np.asarray(np.sqrt(6.0 / np.maximum(ratios, 1.0)) / (2.0 * np.pi))
