"""Algorithms 1 to 4 as printed, with dense matrices: to be read, and a truth for tests.

Nothing here is fast and nothing is shared with the kernels: atoms are columns of length PN, U is a
diagonal matrix, covariances are inverses. Numbers in brackets are the paper's equations.

Misprints: Sec. III-C has rho/omega^2 > T for the test of Algorithm 4, which has zeta for rho in the
precision (77). Left open by the paper and chosen as in the estimator: the first theta of a ramp is
that of the best single component on a grid; how (70) and (71) are maximised afterwards, see
`vsep.reference_costs`; a run ends when nothing moves any more.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.estimator import (
    is_quiet,
    require_one_antenna,
    require_stationary,
    settle,
)
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo, Termination
from vsep.inference.core.state import BurstComponents, ObjectComponents, SeparationState
from vsep.inference.objects.workspace import no_objects
from vsep.reference_costs import (
    Dictionary,
    channel_atoms,
    initial_chirp,
    moments,
    new_object,
    object_atoms,
    refine_chirp,
    refine_object,
    weight_posterior,
)
from vsep.signal.template import SignalModel
from vsep.units import from_db, wrap_frequency


def update_precision(
    dictionary: Dictionary,
    index: int,
    atom: ComplexArray,
    residual: ComplexArray,
    noise_precision: float,
    threshold: float,
) -> Dictionary:
    """Algorithm 4: update, add or prune component `index`, whose basis vector is `atom`.

    A new component has the index behind the last. What is returned has the component with its
    precision, or lacks it; the algorithm's last line, C from (59), is its `weight_posterior`.
    """
    others = dictionary.without(index) if index < len(dictionary.precisions) else dictionary
    found = moments(atom[:, None], others, residual, noise_precision)
    inverse_rho, ratio = float(found[0][0]), float(found[1][0])
    if ratio <= max(threshold, 1.0):  # kept if omega^2/rho > T
        return others
    precision = inverse_rho / (ratio - 1.0)  # gamma = 1/(omega^2 - rho), (77)
    atoms = np.insert(others.atoms, index, atom, axis=1)
    return Dictionary(atoms, np.insert(others.precisions, index, precision))


@dataclass(slots=True)
class RampEstimate:
    """Estimates of one ramp: theta, the active bins with their precisions, and q(beta)."""

    theta: FloatArray
    bins: list[int]
    precisions: FloatArray
    mean: ComplexArray
    covariance: ComplexArray

    def columns(self, model: SignalModel) -> ComplexArray:
        """(N, K) active columns U(theta) Psi."""
        return self.all_columns(model)[:, self.bins]

    def all_columns(self, model: SignalModel) -> ComplexArray:
        """(N, 2N) columns U(theta) psi_k of all grid bins."""
        diagonal = model.template(*self.theta[:, None])[0]  # of U, (12)
        return np.asarray(diagonal[:, None] * channel_atoms(model))

    def update_weights(self, row: ComplexArray, noise_precision: float, model: SignalModel) -> None:
        """C_beta from (62), beta from (61)."""
        dictionary = Dictionary(self.columns(model), self.precisions)
        self.mean, self.covariance = weight_posterior(dictionary, row, noise_precision)

    def update_theta(self, row: ComplexArray, noise_precision: float, model: SignalModel) -> None:
        """Theta from (71)."""
        given = self.theta, self.bins, self.precisions
        self.theta = refine_chirp(*given, row, noise_precision, model)

    def synthesis(self, model: SignalModel) -> tuple[ComplexArray, float]:
        """U Psi beta (N,) and tr(U Psi C Psi^H U^H)."""
        columns = self.columns(model)
        trace = np.trace(columns @ self.covariance @ columns.conj().T).real
        return columns @ self.mean, float(trace)


def update_interference(
    ramp: RampEstimate,
    row: ComplexArray,
    noise_precision: float,
    threshold: float,
    model: SignalModel,
) -> list[EventKind]:
    """Algorithm 2 but for its last line, theta from (71), which Algorithm 1 calls."""
    columns, bins, events = ramp.all_columns(model), ramp.bins, []
    dictionary = Dictionary(columns[:, bins], ramp.precisions)
    _, ratios = moments(columns, dictionary, row, noise_precision)
    ratios[bins] = 0.0
    new = int(np.argmax(ratios))  # the passive k of the largest omega^2/rho
    dictionary = update_precision(
        dictionary, len(bins), columns[:, new], row, noise_precision, threshold
    )
    if len(dictionary.precisions) > len(bins):
        bins = [*bins, new]
        events.append(EventKind.CHANNEL_ADDED)
    for k in list(bins):  # update all active components
        dictionary = update_precision(
            dictionary, bins.index(k), columns[:, k], row, noise_precision, threshold
        )
        if len(dictionary.precisions) < len(bins):
            bins = [other for other in bins if other != k]
            events.append(EventKind.CHANNEL_PRUNED)
    ramp.bins, ramp.precisions = bins, dictionary.precisions
    ramp.update_weights(row, noise_precision, model)  # beta from (61)
    return events


def update_objects(
    objects: ObjectComponents,
    next_id: int,
    frame: ComplexArray,
    noise_precision: float,
    threshold: float,
) -> tuple[ObjectComponents, list[EventKind], float]:
    """Algorithm 3 on r_alpha.

    Returns
    -------
    objects : ObjectComponents
    events : list of EventKind
    max_change : float
        Largest move of a component in standard deviations of an isolated line of its SNR.
    """
    residual, events = frame.ravel(), []
    points = np.stack([objects.beats, objects.dopplers], axis=1)
    ids = objects.component_ids.tolist()
    dictionary = Dictionary(object_atoms(points, frame.shape), objects.precisions)
    # A possible new component: zeta from (70), phi, Algorithm 4.
    zeta = new_object(dictionary, frame, noise_precision, threshold)
    atom = object_atoms(zeta, frame.shape)[:, 0]
    dictionary = update_precision(dictionary, len(ids), atom, residual, noise_precision, threshold)
    if len(dictionary.precisions) > len(ids):
        points, ids = np.vstack([points, wrap_frequency(zeta)]), [*ids, next_id]
    events.append(EventKind.OBJECT_ADDED if next_id in ids else EventKind.OBJECT_REJECTED)
    before = dict(zip(ids, points.copy(), strict=True))
    for name in list(ids):  # update all existing components
        index = ids.index(name)
        others, precision = dictionary.without(index), float(dictionary.precisions[index])
        # zeta_l from (70), phi_l, Algorithm 4; alpha from (58) is formed where it is needed.
        points[index] = refine_object(points[index], precision, others, frame, noise_precision)
        atom = object_atoms(points[index], frame.shape)[:, 0]
        dictionary = update_precision(dictionary, index, atom, residual, noise_precision, threshold)
        if len(dictionary.precisions) < len(ids):
            points, ids = np.delete(points, index, axis=0), [k for k in ids if k != name]
            events.append(EventKind.OBJECT_PRUNED)
    mean, covariance = weight_posterior(dictionary, residual, noise_precision)  # (58)-(59)
    max_change = 0.0
    for index, name in enumerate(ids):
        cells = np.abs(wrap_frequency(points[index] - before[name])) * frame.shape[::-1]
        atom = dictionary.atoms[:, index : index + 1]
        _, ratio = moments(atom, dictionary.without(index), residual, noise_precision)
        deviation = np.sqrt(6.0 / max(float(ratio[0]), 1.0)) / (2.0 * np.pi)
        max_change = max(max_change, float(cells.max()) / deviation)
    points = wrap_frequency(points)
    return (
        ObjectComponents(
            component_ids=np.array(ids, dtype=np.int64),
            beats=points[:, 0].copy(),
            dopplers=points[:, 1].copy(),
            amplitudes=mean,
            covariance=covariance,
            precisions=dictionary.precisions,
        ),
        events,
        max_change,
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class ReferenceSeparator:
    """Algorithm 1 by dense matrices; an `Estimator` for small frames of one antenna.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter.
    threshold_db : float
        T_alpha, dB.
    interference_threshold_db : float
        T_beta, dB.
    max_iterations : int
        Where a run stops at the latest.

    Examples
    --------
    >>> from vsep.signal.filters import RaisedCosineFilter
    >>> from vsep.inference.core.run import run
    >>> model = SignalModel(num_ramps=1, num_samples=32, sample_rate_hz=1e6,
    ...                     anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e5, rolloff=0.25))
    >>> rng = np.random.default_rng(1)
    >>> noise = rng.standard_normal((1, 32)) + 1j * rng.standard_normal((1, 32))
    >>> tone = 100.0 * np.exp(-2j * np.pi * 0.2 * np.arange(32))
    >>> solution = run(ReferenceSeparator(model=model, max_iterations=5), tone + noise)
    >>> round(float(solution.objects.beats[0]), 2)
    0.2
    """

    model: SignalModel
    threshold_db: float = 9.0
    interference_threshold_db: float = 3.0
    max_iterations: int = 100

    def __post_init__(self) -> None:
        """Check the model."""
        require_one_antenna(self.model, "reference")
        require_stationary(self.model, "reference")

    def init(self, received: ComplexArray) -> SeparationState:
        """Empty dictionaries, and lambda = 2 (NP - 1) / ||r||^2."""
        received = self.model.check(received)
        nothing = np.zeros(received.shape, dtype=complex)
        return SeparationState(
            iteration=0,
            objects=no_objects(),
            bursts=(),
            noise_precision=2.0 * (received.size - 1) / float(np.sum(np.abs(received) ** 2)),
            object_signal=nothing,
            interference_signal=nothing,
            next_component_id=0,
        )

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One main iteration of Algorithm 1."""
        model, noise_precision, objects = self.model, state.noise_precision, state.objects
        threshold = float(from_db(self.interference_threshold_db))
        residual = received - state.object_signal  # r_beta
        ramps = [self._ramp(state, p, residual[p]) for p in range(model.num_ramps)]
        events = []
        for p, ramp in enumerate(ramps):
            row = residual[p]
            ramp.update_theta(row, noise_precision, model)  # theta from (71)
            kinds = update_interference(ramp, row, noise_precision, threshold, model)
            events += [_event(kind, p) for kind in kinds]
            ramp.update_theta(row, noise_precision, model)  # last line of Algorithm 2
        parts = [ramp.synthesis(model) for ramp in ramps]  # the new theta, the old beta
        interference = np.array([signal for signal, _ in parts])  # U Psi beta
        interference_trace = sum(trace for _, trace in parts)

        def noise_estimate(objects: ObjectComponents) -> tuple[float, ComplexArray]:
            """Lambda from (65), and Phi alpha."""
            points = np.stack([objects.beats, objects.dopplers], axis=1)
            atoms = object_atoms(points, model.shape)
            signal = (atoms @ objects.amplitudes).reshape(model.shape)
            error = float(np.sum(np.abs(received - signal - interference) ** 2))  # |r_lambda|^2
            error += np.trace(atoms @ objects.covariance @ atoms.conj().T).real
            return received.size / (error + interference_trace), signal

        noise_precision, _ = noise_estimate(objects)
        objects, kinds, max_change = update_objects(  # from r_alpha; (58)-(59) begin Algorithm 3
            objects,
            state.next_component_id,
            received - interference,
            noise_precision,
            float(from_db(self.threshold_db)),
        )
        events += [_event(kind, -1) for kind in kinds]
        noise_precision, object_signal = noise_estimate(objects)
        for p, ramp in enumerate(ramps):  # r_beta = r - Phi alpha; (62), (61)
            ramp.update_weights((received - object_signal)[p], noise_precision, model)
        signals = np.array([ramp.synthesis(model)[0] for ramp in ramps])
        new_state = replace(
            state,
            iteration=state.iteration + 1,
            objects=objects,
            bursts=tuple(_frozen(ramp, p, signals[p]) for p, ramp in enumerate(ramps)),
            noise_precision=noise_precision,
            object_signal=object_signal,
            interference_signal=signals,
            next_component_id=state.next_component_id + kinds.count(EventKind.OBJECT_ADDED),
        )
        return new_state, IterationInfo(
            elbo=0.0,
            events=tuple(events),
            max_frequency_change=max_change,
            noise_precision_change=noise_precision / state.noise_precision - 1.0,
            searched=False,
            separability_ratio_db=float("nan"),
        )

    def _ramp(self, state: SeparationState, p: int, row: ComplexArray) -> RampEstimate:
        """Estimates of a ramp; theta from the grid in the first iteration."""
        none = np.zeros(0, dtype=complex)
        for burst in state.bursts_in(p):
            theta = np.array([burst.start_frequency, burst.slope])
            bins = burst.active_bins.tolist()
            return RampEstimate(theta, bins, burst.precisions, burst.amplitudes, burst.covariance)
        return RampEstimate(
            initial_chirp(row, self.model), [], np.zeros(0), none, none.reshape(0, 0)
        )

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when nothing that matters changed."""
        return settle(state, self.max_iterations, converged=is_quiet(info))


def _frozen(ramp: RampEstimate, p: int, signal: ComplexArray) -> BurstComponents:
    return BurstComponents(
        ramp=p,
        start_frequency=float(ramp.theta[0]),
        slope=float(ramp.theta[1]),
        active_bins=np.array(ramp.bins, dtype=np.int64),
        amplitudes=ramp.mean,
        covariance=ramp.covariance,
        precisions=ramp.precisions,
        energy=float(np.sum(np.abs(signal) ** 2)),
    )


def _event(kind: EventKind, ramp: int) -> ComponentEvent:
    return ComponentEvent(kind=kind, snr_db=float("nan"), threshold_db=float("nan"), ramp=ramp)
