"""Algorithm 3: find, refine, add, update and prune the grid-less object components.

The cost of moving one component, (70), is
``J(zeta) = -log D + lambda^2 |q|^2 / D`` with ``D = lambda + gamma - lambda^2 v^H C v``,
``v = Phi^H phi(zeta)`` and ``q = phi^H (r - Phi mu)``, where Phi, C and mu belong to the *other*
components. Its derivatives need only moments ``sum (j 2 pi n)^a (j 2 pi p)^b ...`` of the residual.
"""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray, to_db, wrap_frequency
from vsep.inference.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.inference.state import ComponentEvent, EventKind, ObjectComponents
from vsep.signal.atoms import gram, line_factors, project, synthesize

MAX_STEP_CELLS = 0.25  # longest Newton step, in resolution cells 1/N and 1/P
NEW_COMPONENT_STEPS = 8  # Newton steps of a candidate from its grid point (half a cell at most)
CANDIDATE_PEAKS = 3  # grid peaks tried when the highest one runs into an existing component
ABSORBED_SHARE = 0.05  # 1/rho below this share of lambda: the others already explain the atom


@dataclass(frozen=True, slots=True, eq=False)
class CostJet:
    """Value, gradient (2,) and Hessian (2, 2) of (70) at one point (beat, doppler)."""

    value: float
    gradient: FloatArray
    hessian: FloatArray


def _derivative_columns(frequency: float, length: int) -> ComplexArray:
    """(3, M) unit-norm line centred at mid-ramp, with its first and second derivative."""
    centred = np.arange(length) - 0.5 * (length - 1)
    rotation = -2j * np.pi * centred
    line = np.exp(rotation * frequency) / np.sqrt(length)
    return np.stack([line, rotation * line, rotation**2 * line])


def cost_jet(
    point: FloatArray,
    precision: float,
    residual: ComplexArray,
    others: ActiveSet,
    other_factors: tuple[ComplexArray, ComplexArray],
) -> CostJet:
    """Cost (70) of one component with analytic gradient and Hessian.

    Parameters
    ----------
    point : (2,) float
        Beat and Doppler frequency.
    precision : float
        Prior precision gamma of the component; zero for a new one.
    residual : (P, N) complex
        Received signal minus the interference estimate.
    others : ActiveSet
        Posterior of the L other components.
    other_factors : tuple of (L, N) and (L, P) complex
        Their beat and Doppler factors.
    """
    num_ramps, num_samples = residual.shape
    beat_columns = _derivative_columns(point[0], num_samples)
    doppler_columns = _derivative_columns(point[1], num_ramps)
    # moments[a, b]: a-th beat and b-th Doppler derivative of phi^H r
    moments = ((residual @ beat_columns.conj().T).T @ doppler_columns.conj().T)
    if len(others):
        beat_products = other_factors[0].conj() @ beat_columns.T
        doppler_products = other_factors[1].conj() @ doppler_columns.T
        moments = moments - np.einsum(
            "la,lb,l->ab", beat_products.conj(), doppler_products.conj(), others.amplitudes
        )
        # rows: v, v_beat, v_doppler, v_beat_beat, v_beat_doppler, v_doppler_doppler
        jet = np.stack(
            [beat_products[:, a] * doppler_products[:, b] for a, b in _JET_ORDERS]
        )
        weighted = jet[:3] @ others.covariance.T
        overlap = (jet.conj() @ weighted.T).real
    else:
        overlap = np.zeros((6, 3))
    noise_precision = others.noise_precision
    return _assemble_jet(moments, overlap, noise_precision, precision)


_JET_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


def _assemble_jet(
    moments: ComplexArray, overlap: FloatArray, noise_precision: float, precision: float
) -> CostJet:
    """Put value, gradient and Hessian of ``-log D + lambda^2 |q|^2 / D`` together."""
    squared = noise_precision**2
    inner = moments[0, 0]
    first = np.array([moments[1, 0], moments[0, 1]])
    second = np.array([[moments[2, 0], moments[1, 1]], [moments[1, 1], moments[0, 2]]])
    power = squared * abs(inner) ** 2
    power_first = 2.0 * squared * (inner.conjugate() * first).real
    power_second = 2.0 * squared * (
        np.outer(first, first.conj()).real + (inner.conjugate() * second).real
    )
    schur = max(noise_precision + precision - squared * overlap[0, 0], 1e-12 * noise_precision)
    schur_first = -2.0 * squared * overlap[1:3, 0]
    crossed = overlap[1:3, 1:3]
    curved = np.array([[overlap[3, 0], overlap[4, 0]], [overlap[4, 0], overlap[5, 0]]])
    schur_second = -2.0 * squared * (curved + 0.5 * (crossed + crossed.T))
    ratio = power / schur
    gradient = (power_first - (1.0 + ratio) * schur_first) / schur
    hessian = (
        power_second
        - (1.0 + ratio) * schur_second
        - (np.outer(power_first, schur_first) + np.outer(schur_first, power_first)) / schur
        + (1.0 + 2.0 * ratio) * np.outer(schur_first, schur_first) / schur
    ) / schur
    return CostJet(float(ratio - np.log(schur)), gradient, hessian)


def refine_point(
    point: FloatArray,
    precision: float,
    residual: ComplexArray,
    others: ActiveSet,
    other_factors: tuple[ComplexArray, ComplexArray],
    *,
    max_steps: int,
) -> FloatArray:
    """Climb (70) by safeguarded Newton steps; the cost never falls.

    Where the Hessian is not negative definite the step follows the gradient, scaled by the
    curvature of an isolated line.
    """
    shape = np.array(residual.shape[::-1], dtype=np.float64)
    free = shape > 1  # a single ramp has no Doppler frequency
    longest = MAX_STEP_CELLS / shape
    current = cost_jet(point, precision, residual, others, other_factors)
    for _ in range(max_steps):
        step = _newton_step(current, free, shape)
        step *= min(1.0, float(np.min(longest / np.maximum(np.abs(step), 1e-300))))
        for _ in range(4):
            trial_point = point + step
            trial = cost_jet(trial_point, precision, residual, others, other_factors)
            if trial.value >= current.value:
                break
            step = 0.25 * step
        else:
            return point
        point, current = trial_point, trial
        if np.all(np.abs(step) * shape < 1e-7):
            break
    return point


def _newton_step(jet: CostJet, free: np.ndarray, shape: FloatArray) -> FloatArray:
    step = np.zeros(2)
    hessian, gradient = jet.hessian[np.ix_(free, free)], jet.gradient[free]
    determinant = hessian[0, 0] if len(gradient) == 1 else np.linalg.det(hessian)
    concave = hessian[0, 0] < 0 and (len(gradient) == 1 or determinant > 0)
    if concave:
        step[free] = -np.linalg.solve(hessian, gradient)
    else:
        curvature = np.abs(np.diagonal(hessian)) + shape[free] ** 2
        step[free] = gradient / curvature
    return step


class ObjectWorkspace:
    """The object components while Algorithm 3 changes them.

    Parameters
    ----------
    components : ObjectComponents
        Where the step starts from.
    residual : (P, N) complex
        r_alpha: received signal minus the interference estimate.
    noise_precision : float
        lambda.
    threshold : float
        T_alpha, linear.
    next_id : int
        Identity of the next new component.
    """

    def __init__(
        self,
        components: ObjectComponents,
        residual: ComplexArray,
        noise_precision: float,
        *,
        threshold: float,
        next_id: int,
    ) -> None:
        self.residual = residual
        self.threshold = threshold
        self.next_id = next_id
        self.events: list[ComponentEvent] = []
        self.ids = components.component_ids.copy()
        self.points = np.stack([components.beats, components.dopplers], axis=1)
        self.beat_factors = line_factors(components.beats, residual.shape[1])
        self.doppler_factors = line_factors(components.dopplers, residual.shape[0])
        self.active = ActiveSet(
            gram(self.beat_factors, self.doppler_factors),
            project(residual, self.beat_factors, self.doppler_factors),
            components.precisions.copy(),
            noise_precision,
        )
        self.max_frequency_change = 0.0

    @property
    def signal(self) -> ComplexArray:
        """(P, N) estimate Phi alpha."""
        return synthesize(self.active.amplitudes, self.beat_factors, self.doppler_factors)

    def add_components(self, max_additions: int) -> None:
        """Add up to `max_additions` new components while candidates pass the threshold."""
        for _ in range(max_additions):
            if not self._add_best_candidate():
                return
            self.active.refresh()

    def _add_best_candidate(self) -> bool:
        best_ratio, best_point = 0.0, np.zeros(2)
        for peak in self._grid_peaks():
            refined = refine_point(
                peak,
                0.0,
                self.residual,
                self.active,
                (self.beat_factors, self.doppler_factors),
                max_steps=NEW_COMPONENT_STEPS,
            )
            for point in (wrap_frequency(refined), peak):
                rho, omega_sq = self._moments_at(point)
                ratio = activation_ratio(rho, omega_sq)
                absorbed = 1.0 / rho < ABSORBED_SHARE * self.active.noise_precision
                if ratio > self.threshold and not absorbed:
                    self._insert(len(self.ids), point, converged_precision(rho, omega_sq))
                    self.ids = np.append(self.ids, self.next_id)
                    self._record(EventKind.OBJECT_ADDED, ratio, self.next_id, point)
                    self.next_id += 1
                    return True
                if ratio > best_ratio:
                    best_ratio, best_point = ratio, point
        self._record(EventKind.OBJECT_REJECTED, best_ratio, -1, best_point)
        return False

    def _grid_peaks(self) -> list[FloatArray]:
        """Highest local maxima of |q|^2 on a grid of half a cell."""
        num_ramps, num_samples = self.residual.shape
        size = (2 * num_ramps if num_ramps > 1 else 1, 2 * num_samples)
        spectrum = np.abs(fft.ifft2(self.residual - self.signal, s=size)) ** 2
        peaks = []
        for _ in range(CANDIDATE_PEAKS):
            row, column = np.unravel_index(int(np.argmax(spectrum)), size)
            peaks.append(wrap_frequency(np.array([column / size[1], row / size[0]])))
            rows = np.arange(row - 2, row + 3) % size[0]
            columns = np.arange(column - 2, column + 3) % size[1]
            spectrum[np.ix_(rows, columns)] = 0.0
        return peaks

    def _moments_at(self, point: FloatArray) -> tuple[float, float]:
        """rho and omega^2 of (23)-(24) of an atom that is not active."""
        jet_beat, jet_doppler = self._atom_factors(point)
        correlations = self._correlations(jet_beat, jet_doppler)
        projection = complex(project(self.residual, jet_beat, jet_doppler)[0])
        noise_precision = self.active.noise_precision
        inverse_rho = noise_precision - noise_precision**2 * float(
            np.vdot(correlations, self.active.covariance @ correlations).real
        )
        if inverse_rho <= 1e-12 * noise_precision:
            return float("inf"), 0.0
        innovation = projection - np.vdot(correlations, self.active.amplitudes)
        return 1.0 / inverse_rho, abs(noise_precision * innovation / inverse_rho) ** 2

    def _atom_factors(self, point: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        num_ramps, num_samples = self.residual.shape
        return line_factors(point[:1], num_samples), line_factors(point[1:], num_ramps)

    def _correlations(self, beat: ComplexArray, doppler: ComplexArray) -> ComplexArray:
        return np.asarray(
            (self.beat_factors.conj() @ beat[0]) * (self.doppler_factors.conj() @ doppler[0])
        )

    def _insert(self, index: int, point: FloatArray, precision: float) -> None:
        beat, doppler = self._atom_factors(point)
        self.active = self.active.inserted(
            index,
            self._correlations(beat, doppler),
            complex(project(self.residual, beat, doppler)[0]),
            1.0,
            precision,
        )
        self.points = np.insert(self.points, index, point, axis=0)
        self.beat_factors = np.insert(self.beat_factors, index, beat[0], axis=0)
        self.doppler_factors = np.insert(self.doppler_factors, index, doppler[0], axis=0)

    def _take_out(self, index: int) -> None:
        self.active = self.active.without(index)
        self.points = np.delete(self.points, index, axis=0)
        self.beat_factors = np.delete(self.beat_factors, index, axis=0)
        self.doppler_factors = np.delete(self.doppler_factors, index, axis=0)

    def update_components(self) -> None:
        """Refine, re-weigh or prune every component in turn (the loop of Algorithm 3)."""
        for component_id in self.ids.copy():
            self._update_component(int(np.flatnonzero(self.ids == component_id)[0]))
        self.active.refresh()

    def _update_component(self, index: int) -> None:
        old_point = self.points[index]
        precision = float(self.active.precisions[index])
        self._take_out(index)
        point = refine_point(
            old_point,
            precision,
            self.residual,
            self.active,
            (self.beat_factors, self.doppler_factors),
            max_steps=1,
        )
        rho, omega_sq = self._moments_at(point)
        ratio = activation_ratio(rho, omega_sq)
        if ratio > self.threshold:
            self._insert(index, wrap_frequency(point), converged_precision(rho, omega_sq))
            cells = np.abs(point - old_point) * np.array(self.residual.shape[::-1])
            deviation = np.sqrt(6.0 / ratio) / (2.0 * np.pi)  # of an isolated line, in cells
            change = float(cells.max()) / deviation
            self.max_frequency_change = max(self.max_frequency_change, change)
        else:
            self._record(EventKind.OBJECT_PRUNED, ratio, int(self.ids[index]), old_point)
            self.ids = np.delete(self.ids, index)

    def _record(self, kind: EventKind, ratio: float, component_id: int, point: FloatArray) -> None:
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(ratio)),
                threshold_db=float(to_db(self.threshold)),
                component_id=component_id,
                beat=float(point[0]),
                doppler=float(point[1]),
            )
        )

    def components(self) -> ObjectComponents:
        """Freeze the result of the step."""
        ids: IntArray = self.ids.astype(np.int64)
        return ObjectComponents(
            component_ids=ids,
            beats=self.points[:, 0].copy(),
            dopplers=self.points[:, 1].copy(),
            amplitudes=self.active.amplitudes,
            covariance=self.active.covariance,
            precisions=self.active.precisions,
        )


def no_objects() -> ObjectComponents:
    """Return an empty object channel."""
    return ObjectComponents(
        component_ids=np.zeros(0, dtype=np.int64),
        beats=np.zeros(0),
        dopplers=np.zeros(0),
        amplitudes=np.zeros(0, dtype=np.complex128),
        covariance=np.zeros((0, 0), dtype=np.complex128),
        precisions=np.zeros(0),
    )
