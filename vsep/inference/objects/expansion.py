r"""Fit of objects near known places to the expansion of a frame around them.

Inner products of an atom with a frame and with other atoms are, within a fraction of a resolution
cell, polynomials of second degree of how far it has moved. Their coefficients are read off once;
Gauss-Newton steps on the joint cost (67) of all places and the fixed points (77) of the prior
precisions then cost as much as there are objects, not samples.

The phase of an atom stands still in the middle of the frame, so that the Gram matrix is real. What
the expansion leaves out is of third degree in the move, whose first term vanishes for a lone atom.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dgetrf, dgetrs, dpotrf, dpotri

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.core.estimator import SETTLED_DEVIATIONS, SETTLED_NOISE
from vsep.inference.core.progress import ComponentEvent, EventKind
from vsep.inference.core.state import ObjectComponents
from vsep.inference.objects.workspace import ObjectThreshold
from vsep.kernels.line_spectra import BEAT_ORDERS, DOPPLER_ORDERS
from vsep.kernels.object_cost import MIN_SCHUR
from vsep.signal.atoms import half_line_jets, half_lines, line_factors
from vsep.units import to_db

REACH_CELLS = 0.06  # by which objects may move from where the frame was expanded
EXPANSIONS = 4  # at most, each from where the one before has led
DROWNED = 10.0  # times the noise that was known: there is more in the frame than its objects
LEFT_OUT_DEVIATIONS = 0.03  # that the terms left out may move an object by
STEPS = 8  # of Gauss and Newton at most, on one expansion
RENEWED = 2  # steps with a Fisher information of their own; it changes with the weights only


@dataclass(frozen=True, slots=True, eq=False)
class Expansion:
    """Second-order expansion of K atoms' inner products around their places.

    Parameters
    ----------
    products : (6, K, A) complex
        With what A antennas received: values, first (b, d) and second derivatives (bb, bd, dd).
    grams : (6, K, K) float
        With each other, derivatives by the first atom's frequencies.
    """

    products: ComplexArray
    grams: FloatArray

    def chosen(self, kept: BoolArray) -> "Expansion":
        """Return that of some of the atoms."""
        return Expansion(self.products[:, kept], self.grams[:, kept][:, :, kept])


@dataclass(frozen=True, slots=True, eq=False)
class NearbyFit:
    """Objects after the fit.

    Parameters
    ----------
    components : ObjectComponents
        Places, precisions and identities count; weights are those of the beginning.
    noise_precision : float
        lambda.
    max_frequency_change : float
        Of the last step, see `vsep.kernels.convergence`.
    events : tuple of ComponentEvent
        Objects that were pruned.
    """

    components: ObjectComponents
    noise_precision: float
    max_frequency_change: float
    events: tuple[ComponentEvent, ...]


def expanded(points: FloatArray, frame: ComplexArray, num_antennas: int) -> Expansion:
    """Expand a frame (A P, N) around points (K, 2).

    Examples
    --------
    One atom in a frame that is this atom: its product is one and has no slope.

    >>> from vsep.signal.atoms import dense_atoms
    >>> places = np.array([[0.1, 0.2]])
    >>> around = expanded(places, dense_atoms(*places.T, (4, 16))[0], 1)
    >>> float(np.round(abs(around.products[0, 0, 0]), 12)), float(around.grams[0, 0, 0].round(12))
    (1.0, 1.0)
    >>> bool(np.all(np.abs(around.products[1:3]) < 1e-9))
    True
    """
    count, (num_rows, num_samples) = len(points), frame.shape
    num_ramps = num_rows // num_antennas
    beat, doppler = half_lines(points[:, 0], num_samples), half_lines(points[:, 1], num_ramps)
    along = _along_samples(frame, beat).reshape(3, count, num_antennas, num_ramps)
    rows = along.transpose(1, 0, 2, 3).reshape(count, 3 * num_antennas, num_ramps)
    whole = (rows @ _conjugate_derivatives(points[:, 1], num_ramps)).reshape(
        count, 3, num_antennas, 3
    )
    products = whole[:, [*BEAT_ORDERS], :, [*DOPPLER_ORDERS]]
    return Expansion(products, half_line_jets(beat, doppler, (num_ramps, num_samples)))


def _along_samples(frame: ComplexArray, lines: FloatArray) -> ComplexArray:
    """(3, K, A P) inner products of lines with rows, and derivatives by the lines' frequency."""
    half, count = lines.shape[3], lines.shape[2]
    right, left = frame[:, frame.shape[1] - half :], frame[:, half - 1 :: -1]
    total, difference = right + left, right - left
    # of x^k (cos + j sin) what is even, and what is odd
    straight, turned = lines.reshape(2, 3 * count, half)
    first = _real_product(straight, total).reshape(3, count, len(frame))
    second = _real_product(turned, difference).reshape(3, count, len(frame))
    along = first + 1j * second
    # The derivative of order k has the factor j^k.
    along[1] = 1j * second[1] - first[1]
    along[2] *= -1.0
    return along


def _real_product(lines: FloatArray, rows: ComplexArray) -> ComplexArray:
    """Lines (K, M) times rows (R, M), (K, R): real numbers by complex ones."""
    parts = np.concatenate([rows.real, rows.imag])
    products = lines @ parts.T
    return np.asarray(products[:, : len(rows)] + 1j * products[:, len(rows) :])


def _conjugate_derivatives(frequencies: FloatArray, length: int) -> ComplexArray:
    """(K, M, 3) conjugate lines, at rest in their middle, and their derivatives."""
    middle = 0.5 * (length - 1)
    lines = line_factors(frequencies, length).conj()
    lines *= np.exp(-2j * np.pi * middle * frequencies)[:, None]
    course = 2j * np.pi * (np.arange(length) - middle)
    return np.stack([lines, course * lines, course * course * lines], axis=2)


def fit_nearby(
    components: ObjectComponents,
    frame: ComplexArray,
    noise_precision: float,
    threshold: ObjectThreshold,
    *,
    num_antennas: int = 1,
    noise_share: float = 1.0,
) -> NearbyFit | None:
    """Fit places and prior precisions of objects that are next to where they are.

    Parameters
    ----------
    components : ObjectComponents
        The objects. Those below the threshold are pruned.
    frame : (A P, N) complex
        Received signal minus what is not objects.
    noise_precision : float
        lambda to begin with.
    threshold : ObjectThreshold
        T_alpha, and the noise it is relative to.
    num_antennas : int
        A.
    noise_share : float
        Share of the noise in (65) that nothing else explains.

    Returns
    -------
    NearbyFit or None
        None where objects are not next to where they were thought to be, or coincide, and where
        the frame holds much more than them.
    """
    sizes = np.array([frame.shape[1], len(frame) // num_antennas])
    energy = float(np.vdot(frame, frame).real)
    events: list[ComponentEvent] = []
    for _ in range(EXPANSIONS):
        points = np.stack([components.beats, components.dopplers], axis=1)
        work = _Nearby(
            expanded(points, frame, num_antennas),
            components,
            noise_precision,
            energy=energy,
            num_noise=frame.size * noise_share,
            sizes=sizes,
            events=events,
        )
        try:
            settled = work.run(threshold)
        except LinAlgError:
            return None
        components, noise_precision = work.components, work.noise_precision
        if settled:
            change = work.max_frequency_change
            return NearbyFit(components, noise_precision, change, tuple(events))
    return None


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
        num_noise: float,
        sizes: IntArray,
        events: list[ComponentEvent],
    ) -> None:
        self.expansion, self.origin = expansion, components
        self.noise_precision, self.energy, self.num_noise = noise_precision, energy, num_noise
        self.events, self.sizes, self.axes = events, sizes, 2 if sizes[1] > 1 else 1
        self.precisions = components.precisions
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
        for number in range(STEPS):
            if not len(self.moves):
                self.noise_precision, self.max_frequency_change = self.num_noise / self.energy, 0.0
                return True
            fit, before = self._fitted(), self.noise_precision
            if number == 0 and fit.error * before > DROWNED * self.num_noise:
                raise LinAlgError("the frame holds much more than noise beside its objects")
            # Where nothing has moved yet, an object may have less than it has at its place.
            if number > 0 and self._update_precisions(fit, threshold):
                continue
            change = abs(self.noise_precision / before - 1.0)
            self._step(fit, renewed=number < RENEWED)
            if np.abs(self.moves * self.sizes).max() > REACH_CELLS:
                return False
            is_still = self.max_frequency_change < SETTLED_DEVIATIONS
            if number > 0 and is_still and change < SETTLED_NOISE:
                return self._is_within_reach(fit)
        return False

    def _is_within_reach(self, fit: _Fit) -> bool:
        """Whether what the expansion leaves out moves no object.

        With the ratio s, a lone object that has moved by m deviations is off by ``0.3 m^3 / s``.
        """
        ratios = np.maximum(self._ratios(fit)[0], 1.0)
        moved = np.abs(self.moves * self.sizes).max(axis=1) / _deviations(ratios)
        return bool(np.all(0.3 * moved**3 < LEFT_OUT_DEVIATIONS * ratios))

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
        cells = np.abs(steps * self.sizes).max(axis=1)
        self.max_frequency_change = float((cells / _deviations(self._ratios(fit)[0])).max())

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

    def _update_precisions(self, fit: _Fit, threshold: ObjectThreshold) -> bool:
        """Algorithm 4 for all objects at once, and lambda; whether any was pruned."""
        ratios, inverse_rho = self._ratios(fit)
        self.noise_precision = self.num_noise / fit.error  # (65)
        components = self.components
        levels = threshold.kept_levels(components.beats, 2 * int(self.sizes[0]))
        ratios = ratios / levels
        kept = ratios > threshold.ratio
        excess = levels * (ratios / fit.weights.shape[1] - 1.0)
        self.precisions = np.where(kept, inverse_rho / np.where(kept, excess, 1.0), 0.0)  # (77)
        if kept.all():
            return False
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
