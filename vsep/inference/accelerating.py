"""Objects that accelerate, beside any estimator of objects that do not.

The estimator works on the frame without the objects that accelerate, and these on what it leaves:
the posterior factorises. An object whose Doppler frequency changes is a cluster of lines to the
estimator. After each of its steps one atom with a curvature is fitted to every such cluster; it
takes the cluster's place where the evidence asks for it: where it explains as much, but for what
the lines that are saved may explain of noise, or more than noise would give it.
"""

from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.errors import InputError
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo, Termination
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.chirped_atoms import (
    MAX_SWEEP_CELLS,
    ChirpedPoint,
    best_chirped_point,
    chirped_products,
    chirped_signals,
    curvature_power,
    refined,
)
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.template import SignalModel
from vsep.units import from_db, to_db, wrap_frequency

CURVATURE_NATS: Final = 8.0  # that a further parameter must explain ...
KEPT_NATS: Final = 6.0  # ... and that one which is there must
SEED_DB: Final = 20.0  # of a line whose acceleration can be told
REACH_CELLS: Final = (1.5, 2.5, 0.5 * MAX_SWEEP_CELLS + 1.5)  # of a cluster's lines, in velocity
BESIDE_CELLS: Final = 1.0  # and in range
MOST_LEFT_OUT: Final = 4  # lines of a cluster that may be objects of their own, each by itself
FIRST_ITERATION: Final = 2


class AcceleratingFit(NamedTuple):
    """One object that accelerates."""

    component_id: int
    point: ChirpedPoint
    amplitudes: ComplexArray  # (A,)
    precision: float


class _Trial(NamedTuple):
    """One atom in the place of a cluster of lines."""

    cluster: BoolArray  # (L,)
    point: ChirpedPoint
    signals: ComplexArray  # (A, P, N) without all other objects
    power: float  # that it explains
    gain: float  # nats


@dataclass(frozen=True, kw_only=True, slots=True)
class AcceleratingSeparator:
    """An estimator of this package with objects that accelerate beside it.

    Parameters
    ----------
    inner : Estimator
        Estimates all other objects, and interference.
    """

    inner: Estimator

    def __post_init__(self) -> None:
        """Check that the objects stay in their range cells."""
        if isinstance(self.model.migration, RampDither):
            raise InputError(
                "Acceleration is modelled with equal ramps; these are dithered, so acceleration "
                "must be neglected."
            )
        if not self.model.is_stationary:
            raise InputError(
                "Acceleration is modelled for objects that stay in their range cells; with "
                "range_migration neglected it can be."
            )

    @property
    def model(self) -> SignalModel:
        """Size, sampling and assumed filter."""
        return self.inner.model

    @property
    def threshold_db(self) -> float:
        """Object threshold T_alpha in force, dB."""
        return self.inner.threshold_db

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step."""
        return self.inner.init(received)

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One step of the inner estimator, then one of the objects that accelerate."""
        shape, num_antennas = self.model.shape, self.model.num_antennas
        fits = accelerating_fits(state.objects, num_antennas)
        signal = fitted_signal(fits, shape, num_antennas)
        received = self.model.check(received)
        plain = replace(
            state,
            objects=without_fits(state.objects),
            object_signal=state.object_signal - signal,
        )
        new, info = self.inner.step(received - signal, plain)
        is_early = new.iteration < FIRST_ITERATION or shape[0] < 4
        if is_early and not fits:
            return new, info
        # What neither source explains, with weights of samples that do not count
        left = new.cleaned(received - signal) - new.object_signal
        work = _Work(new, left.reshape(num_antennas, *shape), self.threshold_db, fits)
        work.refine()
        if not is_early:
            work.look_for_more()
        return work.concluded(info)

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """As the inner estimator decides."""
        return self.inner.terminate(state, info)


class _Work:
    """The objects that accelerate while a step changes them."""

    def __init__(
        self,
        state: SeparationState,
        left: ComplexArray,
        threshold_db: float,
        fits: list[AcceleratingFit],
    ) -> None:
        self.state, self.left, self.fits = state, left, fits
        self.threshold = float(from_db(threshold_db))
        self.precision = state.effective_precision
        self.kept = np.ones(state.objects.num_components, dtype=np.bool_)
        self.events: list[ComponentEvent] = []

    def refine(self) -> None:
        """Move every atom to where it explains most beside all others.

        Weak ones go, and those whose curvature is no longer evident are plain objects again.
        """
        fits, self.fits = self.fits, []
        for fit in fits:
            signals = self.left + fitted_signal(
                [fit], self.left.shape[1:], len(self.left), flat=False
            )
            point = refined(fit.point, signals)
            straight = point._replace(curvature=0.0)
            powers = [_energy(chirped_products(each, signals)) for each in (point, straight)]
            if self.precision * (powers[0] - powers[1]) < KEPT_NATS:
                point = straight
            self._place(fit.component_id, point, signals)

    def _place(self, component_id: int, point: ChirpedPoint, signals: ComplexArray) -> None:
        """Fit the weights of an atom to signals, which become what is left of them."""
        products = chirped_products(point, signals)
        power, count = _energy(products), len(products)
        ratio = self.precision * power
        if ratio <= self.threshold:
            self._tell(EventKind.OBJECT_PRUNED, ratio, component_id, point)
            self.left = signals
            return
        prior = self.precision / (ratio / count - 1.0)  # gamma = 1 / (omega^2 - rho), (77)
        weights = products * (self.precision / (self.precision + prior))
        fit = AcceleratingFit(component_id, point, weights, prior)
        self.fits.append(fit)
        self.left = signals - fitted_signal([fit], signals.shape[1:], count, flat=False)

    def look_for_more(self) -> None:
        """Try one atom in the place of the lines around each strong one, the strongest first."""
        objects = self.state.objects
        for seed in np.argsort(-objects.powers):
            snr = self.precision * objects.powers[seed]
            if self.kept[seed] and snr > from_db(SEED_DB) and self._asks(int(seed)):
                trials = [self._trial(int(seed), lines) for lines in self._clusters(int(seed))]
                best = max(trials, key=lambda each: each.gain)
                if best.gain > CURVATURE_NATS:
                    self._accept(int(seed), best)

    def _asks(self, seed: int) -> bool:
        """Whether there is anything around an object that a curvature could explain."""
        objects = self.state.objects
        if np.count_nonzero(self.kept & self._beside(seed, REACH_CELLS[-1])) > 1:
            return True
        point = ChirpedPoint(float(objects.beats[seed]), float(objects.dopplers[seed]), 0.0)
        return self.precision * curvature_power(point, self.left) > CURVATURE_NATS

    def _beside(self, seed: int, reach_cells: float) -> BoolArray:
        objects, (num_ramps, num_samples) = self.state.objects, self.left.shape[1:]
        across = abs(wrap_frequency(objects.beats - objects.beats[seed])) * num_samples
        along = abs(wrap_frequency(objects.dopplers - objects.dopplers[seed])) * num_ramps
        near: BoolArray = (across < BESIDE_CELLS) & (along < reach_cells)
        return near

    def _clusters(self, seed: int) -> list[BoolArray]:
        """Lines around an object, (L,) bool each: all within a reach, and all but one of them."""
        powers = self.state.objects.powers
        clusters = [self.kept & self._beside(seed, reach) for reach in REACH_CELLS]
        others = np.flatnonzero(clusters[-1])
        for index in others[np.argsort(-powers[others])][: MOST_LEFT_OUT + 1]:
            if index != seed:
                without = clusters[-1].copy()
                without[index] = False
                clusters.append(without)
        return list({cluster.tobytes(): cluster for cluster in clusters}.values())

    def _trial(self, seed: int, cluster: BoolArray) -> "_Trial":
        """Fit one atom to what a cluster and the residual hold."""
        objects = self.state.objects
        lines = objects.chosen(cluster)
        weights = lines.amplitudes.reshape(lines.num_components, len(self.left))
        points = np.stack([lines.beats, lines.dopplers, np.zeros(len(weights))], axis=1)
        signals = self.left + chirped_signals(points, weights, self.left.shape[1:]).sum(axis=0)
        share = lines.powers / lines.powers.sum()
        seed_beat, doppler = float(objects.beats[seed]), float(objects.dopplers[seed])
        beat = seed_beat + float(share @ wrap_frequency(lines.beats - seed_beat))
        point = best_chirped_point(beat, doppler, signals, REACH_CELLS[-1])
        power = _energy(chirped_products(point, signals))
        lost = _energy(signals) - _energy(self.left) - power
        gain = (len(weights) - 1) * self.threshold - self.precision * lost
        return _Trial(cluster, point, signals, power, gain)

    def _accept(self, seed: int, trial: "_Trial") -> None:
        """Put an atom in the place of a cluster."""
        objects = self.state.objects
        own = int(objects.component_ids[seed])
        for index in np.flatnonzero(trial.cluster):
            if index != seed:
                where = float(objects.beats[index]), float(objects.dopplers[index])
                lost_id = int(objects.component_ids[index])
                self._tell(
                    EventKind.OBJECT_PRUNED, self.threshold, lost_id, ChirpedPoint(*where, 0.0)
                )
        self._tell(EventKind.OBJECT_ADDED, self.precision * trial.power, own, trial.point)
        self.kept &= ~trial.cluster
        self._place(own, trial.point, trial.signals)

    def _tell(self, kind: EventKind, ratio: float, component_id: int, point: ChirpedPoint) -> None:
        self.events.append(
            ComponentEvent(
                kind=kind,
                snr_db=float(to_db(max(ratio, 1e-3))),
                threshold_db=float(to_db(self.threshold)),
                component_id=component_id,
                beat=point.beat,
                doppler=point.doppler,
            )
        )

    def concluded(self, info: IterationInfo) -> tuple[SeparationState, IterationInfo]:
        """State and diagnostics with the objects that accelerate among the others."""
        shape, num_antennas = self.left.shape[1:], len(self.left)
        plain = self.state.objects.chosen(self.kept)
        state = self.state
        if not self.fits and self.kept.all():
            return state, replace(info, events=(*info.events, *self.events))
        weights = plain.amplitudes.reshape(plain.num_components, num_antennas)
        points = np.stack([plain.beats, plain.dopplers, np.zeros(len(weights))], axis=1)
        signal = chirped_signals(points, weights, shape).sum(axis=0).reshape(-1, shape[1])
        if self.kept.all():
            signal = state.object_signal
        state = replace(
            state,
            objects=joined_objects(plain, self.fits, self.precision),
            object_signal=signal + fitted_signal(self.fits, shape, num_antennas),
        )
        if self.events:  # errors of the oscillator may have been fitted to what has gone
            state = replace(state, receiver=None, calm_iterations=0, quiet_iterations=0)
        return state, replace(info, events=(*info.events, *self.events))


def _energy(signals: ComplexArray) -> float:
    return float(np.vdot(signals, signals).real)


def fitted_signal(
    fits: list[AcceleratingFit], shape: tuple[int, ...], num_antennas: int, *, flat: bool = True
) -> ComplexArray:
    """Signals of the objects that accelerate, (A P, N) or (A, P, N)."""
    total = np.zeros((num_antennas, *shape), dtype=np.complex128)
    for fit in fits:
        total += chirped_signals(np.array([fit.point]), fit.amplitudes[None], (shape[0], shape[1]))[
            0
        ]
    return total.reshape(-1, shape[1]) if flat else total


def accelerating_fits(objects: ObjectComponents, num_antennas: int) -> list[AcceleratingFit]:
    """Return the objects that accelerate among components."""
    if objects.curvatures is None:
        return []
    weights = objects.amplitudes.reshape(objects.num_components, num_antennas)
    return [
        AcceleratingFit(
            int(objects.component_ids[index]),
            ChirpedPoint(
                float(objects.beats[index]),
                float(objects.dopplers[index]),
                float(objects.curvatures[index]),
            ),
            weights[index],
            float(objects.precisions[index]),
        )
        for index in np.flatnonzero(objects.curvatures)
    ]


def without_fits(objects: ObjectComponents) -> ObjectComponents:
    """Return the components that do not accelerate."""
    if objects.curvatures is None:
        return objects
    return replace(objects.chosen(objects.curvatures == 0.0), curvatures=None)


def joined_objects(
    plain: ObjectComponents, fits: list[AcceleratingFit], precision: float
) -> ObjectComponents:
    """Components of both kinds, those that accelerate behind the others."""
    if not fits:
        return plain
    count, added = plain.num_components, len(fits)
    covariance = np.zeros((count + added, count + added), dtype=np.complex128)
    covariance[:count, :count] = plain.covariance
    priors = np.array([fit.precision for fit in fits])
    rest = np.arange(count, count + added)
    covariance[rest, rest] = 1.0 / (precision + priors)
    weights = np.stack([fit.amplitudes for fit in fits])
    if plain.amplitudes.ndim == 1:
        weights = weights[:, 0]
    points = np.array([fit.point for fit in fits])
    return ObjectComponents(
        component_ids=np.append(plain.component_ids, [fit.component_id for fit in fits]),
        beats=np.append(plain.beats, wrap_frequency(points[:, 0])),
        dopplers=np.append(plain.dopplers, wrap_frequency(points[:, 1])),
        amplitudes=np.concatenate([plain.amplitudes, weights]),
        covariance=covariance,
        precisions=np.append(plain.precisions, priors),
        curvatures=np.append(np.zeros(count), points[:, 2]) if points[:, 2].any() else None,
    )
