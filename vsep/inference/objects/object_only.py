"""Object-only estimator: Algorithm 3 on the received signal, interference neglected."""

from dataclasses import dataclass, field, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, frozen
from vsep._validation import require_choice
from vsep.errors import InputError
from vsep.inference.core.elbo import noise_bound, weights_bound
from vsep.inference.core.environment import with_environment
from vsep.inference.core.estimator import EstimatorEntry, is_quiet, settle
from vsep.inference.core.noise_spectrum import NoiseSpectrum
from vsep.inference.core.progress import IterationInfo, Termination
from vsep.inference.core.schedule import ROBUST, Schedule
from vsep.inference.core.settling import initial_errors
from vsep.inference.core.state import SeparationState
from vsep.inference.core.stopwatch import OBJECTS, part
from vsep.inference.core.thresholds import threshold_from_false_alarm_rate
from vsep.inference.objects.dithered import object_workspace
from vsep.inference.objects.merging import merge_unresolved, merging_due
from vsep.inference.objects.nearby import pays_together, updated_nearby
from vsep.inference.objects.workspace import ObjectThreshold, ObjectWorkspace, no_objects
from vsep.kernels.moving_atoms import STATIONARY
from vsep.parameters import PARAMETERS
from vsep.signal.dithered_atoms import Coupling, RampDither
from vsep.signal.template import SignalModel
from vsep.units import from_db, to_db

MAX_STEP = 1.9  # w at most: beyond half the samples missing, where w < 2 would not hold


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectSettings:
    """Settings of the object part, and the first state: what all estimators share.

    Parameters
    ----------
    model : SignalModel
        Size, sampling and assumed filter.
    false_alarm_rate : float
        Expected false alarms in a noise-only frame; sets the object threshold.
    object_threshold_db : float or None
        The threshold itself, in place of the rate.
    max_iterations : int
        Where a run stops at the latest.
    missing : (P, N) or (A, P, N) bool or None
        Samples that were never received and are left out.
    range_migration : {"modelled", "neglected"}
        Whether objects that move through range cells are modelled where the model has it.
    """

    model: SignalModel
    false_alarm_rate: float = PARAMETERS["false_alarm_rate"].default
    object_threshold_db: float | None = None
    max_iterations: int = PARAMETERS["max_iterations"].default
    missing: BoolArray | None = field(default=None, compare=False, repr=False)
    range_migration: str = PARAMETERS["range_migration"].default

    def __post_init__(self) -> None:
        """Check the settings."""
        choices = PARAMETERS["range_migration"].choices or {}
        require_choice("range_migration", self.range_migration, tuple(choices))
        if self.range_migration == "neglected":
            dither = self.model.migration
            coupling: Coupling = STATIONARY
            if isinstance(dither, RampDither):
                coupling = replace(dither, motion=STATIONARY)
            object.__setattr__(self, "model", replace(self.model, migration=coupling))
        for name, unit in (("false_alarm_rate", "per frame"), ("max_iterations", "")):
            PARAMETERS[name].require(getattr(self, name), name, unit)
        if self.object_threshold_db is not None:
            name = "object_threshold_db"
            PARAMETERS[name].require(self.object_threshold_db, name)
        if self.missing is not None:
            object.__setattr__(self, "missing", self._missing_rows(np.array(self.missing)))

    def _missing_rows(self, missing: BoolArray) -> BoolArray | None:
        """Check what is missing; (A P, N), None if nothing is."""
        rows = self.model.rows_shape
        fits = missing.size == rows[0] * rows[1] and missing.shape[-1] == rows[1]
        if not fits or missing.dtype != np.bool_ or np.count_nonzero(~missing) < 2:
            raise InputError(
                f"missing has shape {missing.shape}, type {missing.dtype} and "
                f"{np.count_nonzero(~missing)} samples that are not missing; it must be boolean, "
                f"{rows}, with at least 2."
            )
        return frozen(missing.reshape(rows)) if missing.any() else None

    def row_steps(self, used: BoolArray) -> FloatArray:
        """Step lengths w of the rows, (A P, 1), by the share of the samples that an antenna has.

        With a common one an antenna that has fewer samples than others would follow more slowly,
        and what it does not follow yet would be taken for objects.
        """
        shares = used.reshape(self.model.num_antennas, -1).mean(axis=1)
        steps = np.minimum(1.0 / np.maximum(shares, 1.0 / used[0].size), MAX_STEP)
        return np.repeat(steps, self.model.num_ramps)[:, None]

    @property
    def threshold_db(self) -> float:
        """Object threshold T_alpha in force, dB."""
        if self.object_threshold_db is not None:
            return self.object_threshold_db
        size = *self.model.shape, self.model.num_antennas
        return float(to_db(threshold_from_false_alarm_rate(self.false_alarm_rate, *size)))

    def object_threshold(
        self, relative_noise: NoiseSpectrum | None, keep: float = 1.0
    ) -> ObjectThreshold:
        """Threshold in force over noise in units of 1/lambda."""
        return ObjectThreshold(float(from_db(self.threshold_db)), relative_noise, keep)

    def init(self, received: ComplexArray) -> SeparationState:
        """State before the first step: no component, lambda = 2 (NP - 1) / ||r||^2.

        Raises
        ------
        InputError
            If the frame has another shape, is all zero, or holds a value that is not finite.
        """
        received = self.model.check(received)
        receiver = initial_errors(received, self.model, self.missing)
        corrected = received if receiver is None else receiver.corrected(received)
        present = corrected if self.missing is None else corrected[~self.missing]
        energy = float(np.sum(np.abs(present) ** 2))
        if energy == 0.0:
            raise InputError("received is zero at every sample that is not missing.")
        return SeparationState(
            iteration=0,
            objects=no_objects(self.model.num_antennas),
            bursts=(),
            # half of the power is noise
            noise_precision=2.0 * (present.size - 1) / energy,
            used_share=present.size / received.size,
            object_signal=np.zeros(self.model.rows_shape, dtype=np.complex128),
            interference_signal=np.zeros(self.model.rows_shape, dtype=np.complex128),
            next_component_id=0,
            receiver=receiver,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ObjectOnlySeparator(ObjectSettings):
    """Algorithm 3 alone: interference and the assumed filter play no part.

    Settings as `ObjectSettings`.
    """

    def step(
        self, received: ComplexArray, state: SeparationState
    ) -> tuple[SeparationState, IterationInfo]:
        """One iteration of Algorithm 3 on the received signal itself."""
        if self.missing is not None:
            return step_on_used(self, received, state, ~self.missing)
        received = state.corrected(received)
        with part(OBJECTS):
            objects = update_objects(  # Algorithm 3 with r_alpha = r
                received,
                state,
                state.noise_precision,
                self.model,
                self.object_threshold(state.relative_noise),
                ROBUST.object_additions(state.iteration),
            )
        object_signal = objects.signal
        noise_residual = received - object_signal
        # denominator of (65)
        error = expected_error(noise_residual, objects.active.trace())
        new_state, info = conclude_objects(state, objects, object_signal, error, received.size)
        return with_environment(state, new_state, info, noise_residual, self.model)

    def terminate(self, state: SeparationState, info: IterationInfo) -> Termination:
        """Converged when nothing happened, nothing moved and lambda is steady."""
        return settle(state, self.max_iterations, converged=is_quiet(info))


def step_on_used(
    settings: ObjectSettings, received: ComplexArray, state: SeparationState, used: BoolArray
) -> tuple[SeparationState, IterationInfo]:
    """One iteration of Algorithm 3 on a whole frame with the gradient of the used samples.

    See `vsep.inference.objects.masked`; `used` is (A P, N) bool.
    """
    model = settings.model
    num_used = int(np.count_nonzero(used))
    share = num_used / used.size
    steps = settings.row_steps(used)  # w
    length = float(steps.mean())
    received = state.corrected(received)
    used_residual = np.where(used, received - state.object_signal, 0.0)  # M (r - Phi alpha)
    with part(OBJECTS):
        objects = update_objects(
            state.object_signal + steps * used_residual,  # r'
            state,
            state.noise_precision / length,  # lambda / w
            model,
            settings.object_threshold(state.relative_noise),
            ROBUST.object_additions(state.iteration),
        )
    object_signal = objects.signal
    difference = received - object_signal
    # (65) over the used samples, which see their share of tr(Phi C Phi^H)
    error = expected_error(difference[used], share * objects.active.trace())
    new_state, info = conclude_objects(state, objects, object_signal, error, num_used)
    return with_environment(
        state,
        new_state,
        info,
        np.where(used, difference, 0.0),
        model,
        interfered=np.flatnonzero(~used.all(axis=1)),
        share=share,
    )


def update_objects(
    residual: ComplexArray,
    state: SeparationState,
    noise_precision: float,
    model: SignalModel,
    threshold: ObjectThreshold,
    max_additions: int,
    schedule: Schedule = ROBUST,
) -> ObjectWorkspace:
    """Run Algorithm 3 on a residual: new components first, then every component in turn.

    Parameters
    ----------
    residual : (A P, N) complex
        Received signal minus the interference estimate.
    state : SeparationState
        Where the step starts from.
    noise_precision : float
        lambda.
    model : SignalModel
        Size of the frame, and how objects move through range cells.
    threshold : ObjectThreshold
        T_alpha and the noise it is relative to.
    max_additions : int
        New components at most.
    schedule : Schedule
        Whether all components move together as well, whether they are next to where they are, and
        whether those that their neighbours explain are given up.
    """
    if schedule.objects_nearby and pays_together(state, model):
        begun = replace(state, noise_precision=noise_precision)
        found = updated_nearby(residual, begun, model, threshold, max_additions)
        if found is not None:
            return found
    workspace = object_workspace(state, residual, noise_precision, model, threshold)
    workspace.add_components(max_additions)  # zeta_new from (70), Algorithm 4
    # for all l: (70), Algorithm 4
    workspace.update_components(jointly=schedule.joint_object_step)
    dithered = isinstance(model.migration, RampDither)
    if schedule.merges_objects and not dithered and merging_due(workspace, state):
        merge_unresolved(workspace)
    return workspace


def conclude_objects(
    state: SeparationState,
    objects: ObjectWorkspace,
    object_signal: ComplexArray,
    error: float,
    num_used: int,
) -> tuple[SeparationState, IterationInfo]:
    """Freeze a step that changed objects only: lambda (65) from the expected error, the bound (19).

    Parameters
    ----------
    state : SeparationState
        Where the step started from.
    objects : ObjectWorkspace
        What it made of the objects.
    object_signal : (P, N) complex
        Phi alpha.
    error : float
        Expected error, see `expected_error`.
    num_used : int
        Samples that count.
    """
    noise_precision = num_used * state.unexplained_share / error  # (65)
    active = objects.active
    bound = weights_bound(
        active.amplitudes,
        np.diagonal(active.covariance).real,
        active.precisions,
        active.log_determinant,
    ) + noise_bound(num_used, noise_precision, error)  # (19)
    new_state = replace(
        state,
        iteration=state.iteration + 1,
        objects=objects.components(),
        noise_precision=noise_precision,
        object_signal=object_signal,
        next_component_id=objects.next_id,
    )
    return new_state, IterationInfo(
        elbo=bound,
        events=tuple(objects.events),
        max_frequency_change=objects.max_frequency_change,
        noise_precision_change=noise_precision / state.noise_precision - 1.0,
        searched=False,
        separability_ratio_db=float("nan"),
    )


def expected_error(residual: ComplexArray, trace: float) -> float:
    """Denominator of (65): residual energy plus the energy of the weights' uncertainty."""
    return float(np.vdot(residual, residual).real) + trace


ENTRIES = (
    EstimatorEntry(
        name="object-only",
        label="Object-only",
        help="Algorithm 3 alone: objects on the received signal, interference neglected.",
        factory=ObjectOnlySeparator,
        position=30,
        several_antennas=True,
    ),
)
