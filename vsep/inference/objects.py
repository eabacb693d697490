"""Algorithm 3: find, refine, add, update and prune the grid-less object components."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray, to_db, wrap_frequency
from vsep.inference.refinement import PlacedComponents, joint_step, place_components, refine_point
from vsep.inference.sbl import activation_ratio, converged_precision
from vsep.inference.state import ComponentEvent, EventKind, ObjectComponents
from vsep.signal.atoms import Factors, line_factors, project, synthesize

NEW_COMPONENT_STEPS = 8  # Newton steps of a candidate from its grid point (half a cell at most)
CANDIDATE_PEAKS = 3  # grid peaks tried when the highest one runs into an existing component
ADDITION_WINDOW = 0.25  # of the first candidate's ratio: what a further one of the step must reach
ABSORBED_SHARE = 0.05  # 1/rho below this share of lambda: the others already explain the atom


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Separable columns (M, N) x (M, P) of another source, and their prior precisions (M,)."""

    factors: Factors
    precisions: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A place (2,) where a new component might be, with its activation ratio and precision.

    ``absorbed`` says that the components already there explain its atom almost completely.
    """

    point: FloatArray
    ratio: float
    precision: float
    absorbed: bool


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
    background : Background, optional
        Columns of another source that share the joint posterior, in place of being subtracted.
    """

    def __init__(
        self,
        components: ObjectComponents,
        residual: ComplexArray,
        noise_precision: float,
        *,
        threshold: float,
        next_id: int,
        background: Background | None = None,
    ) -> None:
        self.residual = residual
        self.threshold = threshold
        self.next_id = next_id
        self.events: list[ComponentEvent] = []
        self.ids = components.component_ids.copy()
        precisions = components.precisions
        if background is not None:
            precisions = np.concatenate([precisions, background.precisions])
        self._place(
            place_components(
                np.stack([components.beats, components.dopplers], axis=1),
                precisions,
                residual,
                noise_precision,
                None if background is None else background.factors,
            )
        )
        self.max_frequency_change = 0.0

    def _place(self, placed: PlacedComponents) -> None:
        self.points = placed.points
        self.beat_factors, self.doppler_factors = placed.factors
        self.active = placed.active

    @property
    def signal(self) -> ComplexArray:
        """(P, N) estimate Phi alpha."""
        count = len(self.ids)
        return synthesize(
            self.active.amplitudes[:count], self.beat_factors[:count], self.doppler_factors[:count]
        )

    def _unexplained(self) -> ComplexArray:
        """(P, N) residual minus everything among the columns."""
        return self.residual - synthesize(
            self.active.amplitudes, self.beat_factors, self.doppler_factors
        )

    def add_components(self, max_additions: int) -> None:
        """Add up to `max_additions` new components, the strongest candidate first.

        Further ones must come close to the first in strength: a much weaker candidate may be a side
        lobe or a piece of a burst that the next iteration explains.
        """
        weakest = self.threshold
        for number in range(max_additions):
            candidate = self._best_candidate()
            if candidate.absorbed or candidate.ratio <= weakest:
                if number == 0:
                    self._record(EventKind.OBJECT_REJECTED, candidate.ratio, -1, candidate.point)
                return
            weakest = max(weakest, ADDITION_WINDOW * candidate.ratio)
            self._insert(len(self.ids), candidate.point, candidate.precision)
            self.active.refresh()
            self.ids = np.append(self.ids, self.next_id)
            self._record(EventKind.OBJECT_ADDED, candidate.ratio, self.next_id, candidate.point)
            self.next_id += 1

    def _best_candidate(self) -> Candidate:
        """Return the first usable of the highest grid peaks, refined if that stays clear."""
        best = Candidate(np.zeros(2), 0.0, 0.0, absorbed=True)
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
                candidate = self._candidate_at(point)
                if candidate.ratio > self.threshold and not candidate.absorbed:
                    return candidate
                if candidate.ratio > best.ratio:
                    best = candidate
        return best

    def _candidate_at(self, point: FloatArray) -> Candidate:
        rho, omega_sq = self._moments_at(point)
        ratio = activation_ratio(rho, omega_sq)
        precision = converged_precision(rho, omega_sq) if ratio > 1.0 else np.inf
        absorbed = 1.0 / rho < ABSORBED_SHARE * self.active.noise_precision
        return Candidate(point, ratio, precision, absorbed=absorbed)

    def _grid_peaks(self) -> list[FloatArray]:
        """Highest local maxima of |q|^2 on a grid of half a cell."""
        num_ramps, num_samples = self.residual.shape
        size = (2 * num_ramps if num_ramps > 1 else 1, 2 * num_samples)
        spectrum = np.abs(fft.ifft2(self._unexplained(), s=size)) ** 2
        peaks = []
        for _ in range(CANDIDATE_PEAKS):
            row, column = np.unravel_index(int(np.argmax(spectrum)), size)
            peaks.append(wrap_frequency(np.array([column / size[1], row / size[0]])))
            rows = np.arange(row - 2, row + 3) % size[0]
            columns = np.arange(column - 2, column + 3) % size[1]
            spectrum[np.ix_(rows, columns)] = 0.0
        return peaks

    def _moments_at(self, point: FloatArray) -> tuple[float, float]:
        """Moments rho and omega^2 of (23)-(24) of an atom that is not active."""
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
        return 1.0 / inverse_rho, float(abs(noise_precision * innovation / inverse_rho) ** 2)

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
        """Refine, re-weigh or prune every component in turn (the loop of Algorithm 3).

        Deviation: a joint step of all components follows, which the paper does not have; it takes
        the place of tens of rounds where components share a resolution cell.
        """
        start = dict(zip(self.ids.tolist(), self.points, strict=True))
        for component_id in self.ids.copy():
            self._update_component(int(np.flatnonzero(self.ids == component_id)[0]))
        count = len(self.ids)
        placed = place_components(
            self.points,
            self.active.precisions,
            self.residual,
            self.active.noise_precision,
            (self.beat_factors[count:], self.doppler_factors[count:]),
        )
        placed = joint_step(placed, self.residual)
        self._measure_change(start, placed)
        self._place(replace(placed, points=wrap_frequency(placed.points)))

    def _measure_change(self, start: dict[int, FloatArray], placed: PlacedComponents) -> None:
        """Largest move since the step began, in deviations of isolated lines."""
        for index, component_id in enumerate(self.ids.tolist()):
            offset = wrap_frequency(placed.points[index] - start[component_id])
            cells = np.abs(offset) * np.array(self.residual.shape[::-1])
            ratio = activation_ratio(*placed.active.flat_prior_moments(index))
            deviation = np.sqrt(6.0 / max(ratio, 1.0)) / (2.0 * np.pi)
            change = float(cells.max()) / deviation
            self.max_frequency_change = max(self.max_frequency_change, change)

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
            amplitudes=self.active.amplitudes[: len(ids)],
            covariance=self.active.covariance[: len(ids), : len(ids)],
            precisions=self.active.precisions[: len(ids)],
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


def object_factors(components: ObjectComponents, shape: tuple[int, ...]) -> Factors:
    """Beat (L, N) and Doppler (L, P) factors of all components in a frame of shape (P, N)."""
    num_ramps, num_samples = shape
    beat = line_factors(components.beats, num_samples)
    return beat, line_factors(components.dopplers, num_ramps)
