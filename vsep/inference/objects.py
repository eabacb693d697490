"""Algorithm 3: find, refine, add, update and prune the grid-less object components."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft

from vsep._arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    to_db,
    wrap_frequency,
)
from vsep.inference.antennas import SharedSet, synthesize_all, update_shared
from vsep.inference.refinement import (
    PlacedComponents,
    cost_jet,
    joint_step,
    place_components,
    refine_point,
)
from vsep.inference.sbl import converged_precision
from vsep.inference.state import ComponentEvent, EventKind, ObjectComponents
from vsep.kernels.climbing import update_lines
from vsep.kernels.lines import LEAST_SCHUR, Columns, CostJet
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
    residual : (P, N) or, of several antennas, (A P, N) complex
        r_alpha: received signal minus the interference estimate.
    noise_precision : float
        lambda.
    threshold : float
        T_alpha, linear; the sum of the antennas' ratios is compared with it.
    next_id : int
        Identity of the next new component.
    background : Background, optional
        Columns of another source that share the joint posterior, in place of being subtracted.
    num_antennas : int
        A.
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
        num_antennas: int = 1,
    ) -> None:
        if num_antennas > 1:
            residual = residual.reshape(num_antennas, -1, residual.shape[1])
        # A writable copy: for read-only arrays the kernels would be compiled a second time.
        self.residual = residual.copy()
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
        """(P, N) or (A P, N) estimate Phi alpha."""
        signal = self._synthesize(len(self.ids))
        return signal if signal.ndim == 2 else signal.reshape(-1, signal.shape[2])

    def _unexplained(self) -> ComplexArray:
        """(P, N) or (A, P, N) residual minus everything among the columns."""
        return self.residual - self._synthesize(len(self.active))

    def _synthesize(self, count: int) -> ComplexArray:
        """Sum of the first columns."""
        amplitudes = self.active.amplitudes[:count]
        factors = self.beat_factors[:count], self.doppler_factors[:count]
        if isinstance(self.active, SharedSet):
            return synthesize_all(amplitudes, factors)
        return synthesize(amplitudes, *factors)

    @property
    def num_antennas(self) -> int:
        """Number of antennas, each with weights of its own."""
        return len(self.residual) if self.residual.ndim == 3 else 1

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
        others = self.residual, self.active, (self.beat_factors, self.doppler_factors)
        for peak in self._grid_peaks():
            top = refine_point(peak, 0.0, *others, max_steps=NEW_COMPONENT_STEPS)
            for point in (top, peak):
                candidate = self._candidate(point, cost_jet(point, 0.0, *others))
                if candidate.ratio > self.threshold and not candidate.absorbed:
                    return candidate
                if candidate.ratio > best.ratio:
                    best = candidate
        return best

    def _candidate(self, point: FloatArray, jet: CostJet) -> Candidate:
        noise_precision = self.active.noise_precision
        absorbed = jet.inverse_rho < ABSORBED_SHARE * noise_precision
        if jet.inverse_rho <= LEAST_SCHUR * noise_precision:
            return Candidate(point, 0.0, np.inf, absorbed=True)
        rho = 1.0 / jet.inverse_rho
        ratio = jet.power * rho
        mean = ratio / self.num_antennas
        precision = converged_precision(rho, mean * rho) if mean > 1.0 else np.inf
        return Candidate(wrap_frequency(point), ratio, precision, absorbed=absorbed)

    def _grid_peaks(self) -> list[FloatArray]:
        """Highest local maxima of |q|^2 on a grid of half a cell."""
        num_ramps, num_samples = self.residual.shape[-2:]
        size = (2 * num_ramps if num_ramps > 1 else 1, 2 * num_samples)
        # Single precision: the peaks are starting points of a climb.
        transform = fft.ifft2(self._unexplained().astype(np.complex64), s=size)
        spectrum = transform.real**2 + transform.imag**2
        if spectrum.ndim == 3:
            spectrum = spectrum.sum(axis=0)
        peaks = []
        for _ in range(CANDIDATE_PEAKS):
            row, column = np.unravel_index(int(np.argmax(spectrum)), size)
            peaks.append(wrap_frequency(np.array([column / size[1], row / size[0]])))
            rows = np.arange(row - 2, row + 3) % size[0]
            columns = np.arange(column - 2, column + 3) % size[1]
            spectrum[np.ix_(rows, columns)] = 0.0
        return peaks

    def _atom_factors(self, point: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        num_ramps, num_samples = self.residual.shape[-2:]
        return line_factors(point[:1], num_samples), line_factors(point[1:], num_ramps)

    def _correlations(self, beat: ComplexArray, doppler: ComplexArray) -> ComplexArray:
        return np.asarray(
            (self.beat_factors.conj() @ beat[0]) * (self.doppler_factors.conj() @ doppler[0])
        )

    def _insert(self, index: int, point: FloatArray, precision: float) -> None:
        if isinstance(self.active, SharedSet):
            points = np.insert(self.points, index, point, axis=0)
            precisions = np.insert(self.active.precisions, index, precision)
            noise_precision = self.active.noise_precision
            self._place(place_components(points, precisions, self.residual, noise_precision))
            return
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

    def update_components(self) -> None:
        """Refine, re-weigh or prune every component in turn (the loop of Algorithm 3).

        Deviation: a joint step of all components follows, which the paper does not have; it takes
        the place of tens of rounds where components share a resolution cell.
        """
        start = dict(zip(self.ids.tolist(), self.points, strict=True))
        points, precisions, kept, ratios = self._update_each()
        for index in np.flatnonzero(~kept):
            ratio, component_id = float(ratios[index]), int(self.ids[index])
            self._record(EventKind.OBJECT_PRUNED, ratio, component_id, self.points[index])
        before = len(self.ids)
        self.ids = self.ids[kept]
        placed = place_components(
            points[kept],
            np.concatenate([precisions[:before][kept], precisions[before:]]),
            self.residual,
            self.active.noise_precision,
            (self.beat_factors[before:], self.doppler_factors[before:]),
        )
        placed = joint_step(placed, self.residual)
        self._measure_change(start, placed)
        self._place(replace(placed, points=wrap_frequency(placed.points)))

    def _update_each(self) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
        """Points, precisions, which stay, and their ratios, after every component had its turn."""
        if isinstance(self.active, SharedSet):
            return update_shared(self.points, self.active, self.residual, self.threshold)
        points = self.points.copy()
        precisions = self.active.precisions.copy()
        kept, ratios = update_lines(
            points,
            precisions,
            self.residual,
            Columns(
                self.beat_factors.copy(),
                self.doppler_factors.copy(),
                self.active.covariance.copy(),
                self.active.amplitudes.copy(),
                self.active.noise_precision,
            ),
            self.threshold,
        )
        return points, precisions, kept, ratios

    def _measure_change(self, start: dict[int, FloatArray], placed: PlacedComponents) -> None:
        """Largest move since the step began, in deviations of isolated lines."""
        if len(self.ids) == 0:
            return
        before = np.array([start[component_id] for component_id in self.ids.tolist()])
        cells = np.abs(wrap_frequency(placed.points - before)) * self.residual.shape[:-3:-1]
        active, count = placed.active, len(self.ids)
        variance = np.diagonal(active.covariance)[:count].real
        inverse_rho = 1.0 / variance - active.precisions[:count]
        power = np.abs(active.amplitudes[:count]) ** 2
        if power.ndim == 2:
            power = power.sum(axis=1)
        # omega^2 / rho as in `ActiveSet.flat_prior_moments`; 1 where the others explain a weight.
        hidden = inverse_rho <= 0.0
        ratio = power / (variance**2 * np.where(hidden, np.inf, inverse_rho))
        deviation = np.sqrt(6.0 / np.maximum(ratio, 1.0)) / (2.0 * np.pi)
        self.max_frequency_change = float(np.max(cells.max(axis=1) / deviation))

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


def no_objects(num_antennas: int = 1) -> ObjectComponents:
    """Return an empty object channel."""
    shape = (0,) if num_antennas == 1 else (0, num_antennas)
    return ObjectComponents(
        component_ids=np.zeros(0, dtype=np.int64),
        beats=np.zeros(0),
        dopplers=np.zeros(0),
        amplitudes=np.zeros(shape, dtype=np.complex128),
        covariance=np.zeros((0, 0), dtype=np.complex128),
        precisions=np.zeros(0),
    )


def object_factors(components: ObjectComponents, shape: tuple[int, ...]) -> Factors:
    """Beat (L, N) and Doppler (L, P) factors of all components in a frame of shape (P, N)."""
    num_ramps, num_samples = shape
    beat = line_factors(components.beats, num_samples)
    return beat, line_factors(components.dopplers, num_ramps)
