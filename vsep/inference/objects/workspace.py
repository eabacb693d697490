"""Algorithm 3: addition, refinement, update and pruning of grid-less object components."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.inference.core.noise_spectrum import NoiseSpectrum
from vsep.inference.core.progress import ComponentEvent, EventKind
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.objects.refinement import (
    PlacedComponents,
    joint_step,
    place_components,
    with_component,
)
from vsep.inference.objects.sbl import ActiveSet
from vsep.kernels.candidates import Candidate, best_candidate, candidate_peaks
from vsep.kernels.convergence import largest_change
from vsep.kernels.doppler_intervals import unfold_lines
from vsep.kernels.line_spectra import Columns
from vsep.kernels.moving_atoms import STATIONARY, Migration
from vsep.kernels.newton_ascent import update_lines
from vsep.kernels.object_posterior import (
    lines_trace,
    object_signals,
    subtract_columns,
)
from vsep.signal.atoms import Factors, project
from vsep.signal.dithered_atoms import Coupling, coupled_jets, coupled_products, coupled_signals
from vsep.signal.keystone import SingleComplexArray, keystone_transform
from vsep.signal.template import SignalModel
from vsep.units import to_db, wrap_frequency

ADDITION_WINDOW = 0.25  # of the first candidate's ratio: what a further one of the step must reach
LARGE = 2**16  # samples: a transform for each new object would take longer than all the rest
KEEP_COLOURED = 0.97  # of its threshold: what an object that is there must reach in coloured noise


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Separable columns (M, N) x (M, P) of another source, and their prior precisions (M,)."""

    factors: Factors
    precisions: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ObjectThreshold:
    """What the activation ratio of an object must exceed.

    Parameters
    ----------
    ratio : float
        T_alpha, linear; the sum of the antennas' ratios is compared with it.
    relative_noise : NoiseSpectrum or None
        Noise over beat frequency in units of 1/lambda; None where it is white.
    keep : float
        Share of the threshold that an object which is there must reach.
    """

    ratio: float
    relative_noise: NoiseSpectrum | None = None
    keep: float = 1.0

    def levels(self, beats: FloatArray) -> FloatArray:
        """Noise at these beats in units of 1/lambda."""
        if self.relative_noise is None:
            return np.ones(len(beats))
        return self.relative_noise.cautious_level(beats, self.ratio)

    def kept_levels(self, beats: FloatArray, grid: int) -> FloatArray:
        """Noise at objects that are there: that of the nearest of so many candidates, or less.

        Where thresholds are not the same as when it was added, an object close to its own would
        come and go for ever.
        """
        if self.relative_noise is None:
            levels = np.ones(len(beats))
        else:
            levels = KEEP_COLOURED * self.levels(np.rint(beats * grid) / grid)
        return levels if self.keep == 1.0 else self.keep * levels


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
    threshold : ObjectThreshold
        T_alpha and the noise it is relative to.
    next_id : int
        Identity of the next new component.
    background : Background, optional
        Columns of another source that share the joint posterior, in place of being subtracted.
    num_antennas : int
        A.
    migration : Migration
        How objects move through range cells; without a background only.

    Attributes
    ----------
    searched : (R, 2N) bool or None
        Points of `candidate_grid` at which new components may be; None: all.
    """

    def __init__(
        self,
        components: ObjectComponents,
        residual: ComplexArray,
        noise_precision: float,
        *,
        threshold: ObjectThreshold,
        next_id: int,
        background: Background | None = None,
        num_antennas: int = 1,
        migration: Coupling = STATIONARY,
    ) -> None:
        # Writable copies: for read-only arrays the kernels would be compiled a second time.
        self.residual = residual.copy()
        self.num_antennas = num_antennas
        self.threshold = threshold
        self.next_id = next_id
        self.searched: BoolArray | None = None
        self._peaks: tuple[NDArray[np.float32], IntArray] | None = None  # not tried yet
        self.events: list[ComponentEvent] = []
        self.ids = components.component_ids.copy()
        if background is None:
            background = no_background(len(residual) // num_antennas, residual.shape[1])
        # (58)-(59) with the new residual and lambda
        self.placed = place_components(
            np.array([components.beats, components.dopplers]).T.copy(),
            np.concatenate([components.precisions, background.precisions]),
            self.residual,
            noise_precision,
            background.factors,
            migration,
        )
        self._summed: tuple[PlacedComponents | None, ComplexArray] = None, self.residual
        self.max_frequency_change = 0.0

    @property
    def points(self) -> FloatArray:
        """(L, 2) beat and Doppler frequency of each component."""
        return self.placed.points

    @property
    def factors(self) -> Factors:
        """Beat (L, N) and Doppler (L, P) factors of the components."""
        beat, doppler = self.placed.factors
        return beat[: len(self.ids)], doppler[: len(self.ids)]

    @property
    def active(self) -> ActiveSet:
        """Posterior of the weights of all columns."""
        return self.placed.active

    @property
    def signal(self) -> ComplexArray:
        """(P, N) or (A P, N) estimate Phi alpha."""
        placed, signal = self._summed
        if placed is not self.placed:
            weights = self.placed.columns.amplitudes[: len(self.ids)]
            if self.is_stationary:
                signal = object_signals(*self.factors, weights)  # Phi alpha
            else:
                migration = self.placed.migration
                signal = coupled_signals(self.points, weights, migration, *self._shape)
            self._summed = self.placed, signal
        return signal

    @property
    def is_stationary(self) -> bool:
        """Whether objects stay in their range cells."""
        return self.placed.migration.coupling == 0.0

    @property
    def _shape(self) -> tuple[int, int]:
        """(P, N)."""
        return len(self.residual) // self.num_antennas, self.residual.shape[1]

    def products(self, signals: ComplexArray) -> ComplexArray:
        """(L, A) inner products of the components with signals (A P, N)."""
        if self.is_stationary:
            frames = signals.reshape(self.num_antennas, *self._shape)
            return np.stack([project(each, *self.factors) for each in frames], axis=1)
        return coupled_products(self.points, self.placed.migration, self._shape[0], signals)

    def add_components(self, max_additions: int) -> None:
        """Add up to `max_additions` new components, the strongest candidate first.

        Further ones must come close to the first in strength: a much weaker candidate may be a side
        lobe or a piece of a burst that the next iteration explains. In large frames they are sought
        among the peaks of one transform, as long as these hold any.
        """
        weakest = self.threshold.ratio
        number, self._peaks = 0, None
        while number < max_additions:
            is_new = self._peaks is None
            candidate = self._best_candidate()  # zeta_new from (70)
            if candidate.absorbed or candidate.ratio <= weakest:  # Algorithm 4: omega^2/rho > T
                if is_new:
                    if number == 0:
                        self._record(EventKind.OBJECT_REJECTED, candidate.ratio, -1, candidate[:2])
                    return
                self._peaks = None
                continue
            weakest = max(weakest, ADDITION_WINDOW * candidate.ratio)
            self._insert(candidate)  # Phi and gamma grow, C from (59)
            if self.residual.size < LARGE:
                self._peaks = None
            self.ids = np.append(self.ids, self.next_id)
            self._record(EventKind.OBJECT_ADDED, candidate.ratio, self.next_id, candidate[:2])
            self.next_id, number = self.next_id + 1, number + 1

    def _best_candidate(self) -> Candidate:
        """Look for one more component in what the columns leave unexplained."""
        columns, threshold, levels = self.placed.columns, self.threshold, np.ones(1)
        if threshold.relative_noise is not None:
            num_samples = self.residual.shape[1]
            levels = threshold.levels(np.arange(2 * num_samples) / (2 * num_samples))
        if self._peaks is None:
            transforms = candidate_grid(self._left(columns), columns.migration or STATIONARY)
            if self.searched is not None:
                transforms = transforms * self.searched
            self._peaks = candidate_peaks(transforms, columns, levels)
        # Peaks of the periodogram over the noise, refined by (70)
        return best_candidate(self._peaks, self.residual, columns, threshold.ratio, levels)

    def _left(self, columns: Columns) -> SingleComplexArray:
        """Return what the columns leave of the residual, r_alpha - Phi alpha (A, P, N)."""
        placed, signal = self._summed
        if placed is not self.placed:
            return subtract_columns(self.residual, columns)
        left = (self.residual - signal).astype(np.complex64)  # what they explain is known
        return left.reshape(self.num_antennas, -1, left.shape[1])

    def _insert(self, candidate: Candidate) -> None:
        """Place a new component behind the others, ahead of the background."""
        point = np.array([candidate.beat, candidate.doppler])
        self.placed = with_component(self.placed, point, candidate.precision, self.residual)

    def update_components(self, *, jointly: bool = True) -> None:
        """Refine, re-estimate or prune every component in turn (the loop of Algorithm 3).

        Deviation: `jointly` a step of all components follows, which the paper does not have; it
        takes the place of tens of rounds where components share a resolution cell.
        """
        start = self.points
        if not self.is_stationary:
            self.placed = self._unfolded(self.placed)
        before, active = self.placed, self.active
        # For all l: zeta_l from (70), Algorithm 4
        new = update_lines(
            before.points,
            active.precisions,
            self.residual,
            before.columns,
            self.threshold.ratio,
            self.threshold.kept_levels(before.points[:, 0], 2 * self.residual.shape[1]),
        )
        points, precisions = new.points, new.precisions
        if not new.kept.all():
            self.forget(new.kept, new.ratios)
            points, start = points[new.kept], start[new.kept]
            precisions = np.delete(precisions, np.flatnonzero(~new.kept))
        noise_precision = active.noise_precision
        # C from (59), alpha from (58), without the rounding of the rank-one updates
        placed = place_components(
            points, precisions, self.residual, noise_precision, before.background, before.migration
        )
        if jointly:
            placed = joint_step(placed, self.residual)  # all zeta from (67)
        self.max_frequency_change = largest_change(
            start, placed.points, placed.active.precisions, placed.columns
        )
        points = wrap_frequency(placed.points)
        if not self.is_stationary:
            points[:, 1] = placed.points[:, 1]
        self.placed = PlacedComponents(points, placed.factors, placed.active, placed.migration)

    def _unfolded(self, placed: PlacedComponents) -> PlacedComponents:
        """Move components to the interval of Doppler frequency that they belong to."""
        active = placed.active
        points = unfold_lines(placed.points, active.precisions, self.residual, placed.columns)
        if np.array_equal(points, placed.points):
            return placed
        return place_components(
            points,
            active.precisions,
            self.residual,
            active.noise_precision,
            placed.background,
            placed.migration,
        )

    def forget(self, kept: BoolArray, ratios: FloatArray) -> None:
        """Record that all other components (L,) are given up, and their ratios; drop their ids."""
        for index in np.flatnonzero(~kept):
            ratio, component_id = float(ratios[index]), int(self.ids[index])
            self._record(EventKind.OBJECT_PRUNED, ratio, component_id, self.points[index])
        self.ids = self.ids[kept]

    def _record(
        self,
        kind: EventKind,
        ratio: float,
        component_id: int,
        point: FloatArray | tuple[float, float],
    ) -> None:
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(ratio)),
                threshold_db=float(to_db(self.threshold.ratio)),
                component_id=component_id,
                beat=float(point[0]),
                doppler=float(point[1]),
            )
        )

    def components(self) -> ObjectComponents:
        """Freeze the result of the step."""
        count, active = len(self.ids), self.active
        return ObjectComponents(
            component_ids=self.ids,
            beats=self.points[:, 0],
            dopplers=self.points[:, 1],
            amplitudes=active.amplitudes[:count],
            covariance=active.covariance[:count, :count],
            precisions=active.precisions[:count],
        )


def candidate_grid(signals: SingleComplexArray, migration: Migration) -> SingleComplexArray:
    """Transform signals (A, P, N) to the grid of candidates (A, R, 2N), two points in a cell.

    Columns are beats from 0 on. Rows are Doppler frequencies from 0 on or, of objects that move
    through range cells, `keystone_dopplers`.
    """
    if migration.coupling != 0.0:
        return keystone_transform(signals, migration)
    # Axis after axis: a transform of both would run over the added rows of zeros as well.
    if signals.shape[1] > 1:
        signals = fft.ifft(signals, 2 * signals.shape[1], axis=1)
    return np.asarray(fft.ifft(signals, 2 * signals.shape[2], axis=2))


@lru_cache(maxsize=16)
def no_background(num_ramps: int, num_samples: int) -> Background:
    """Return a background without columns."""
    factors = (
        np.empty((0, num_samples), dtype=np.complex128),
        np.empty((0, num_ramps), dtype=np.complex128),
    )
    return Background(factors, np.empty(0))


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


def objects_trace(components: ObjectComponents, model: SignalModel) -> float:
    """tr(Phi C Phi^H), the expected energy of the weights' uncertainty at all antennas."""
    points = np.array([components.beats, components.dopplers])
    if model.is_stationary:
        trace = lines_trace(points, components.covariance.copy(), *model.shape)
    else:
        gram = coupled_jets(points.T.copy(), model.migration, *model.shape, 1)[0]
        trace = float(np.vdot(gram, components.covariance).real)
    return model.num_antennas * trace


def without_objects(state: SeparationState) -> SeparationState:
    """Return a state that has found no object yet."""
    nothing = np.zeros_like(state.object_signal)
    antennas = state.objects.amplitudes.shape[1:]
    objects = no_objects(antennas[0] if antennas else 1)
    return replace(state, objects=objects, object_signal=nothing)
