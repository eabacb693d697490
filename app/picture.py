"""Everything that the views draw, as plain arrays in display units.

A `Picture` is made from the backdrop of a run and the steps up to the iteration shown; screen and
report draw from the same one, so they cannot differ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from app.backdrop import Backdrop, ByteArray
from app.marks import Marks, added_marks, channel_marks, object_marks, pruned_marks, true_marks
from app.words import (
    AngleColumns,
    Located,
    LogLine,
    TableRow,
    log_lines,
    resolution_cells,
    table_rows,
)
from vsep._arrays import BoolArray, ComplexArray, FloatArray, to_db
from vsep.analysis.angles import object_angles
from vsep.inference.progress import Step, Termination
from vsep.inference.state import ObjectComponents, SeparationState
from vsep.inference.stopwatch import summed
from vsep.inference.uncertainty import dispersion_std

FLASH_ITERATIONS = 3
FADE_ITERATIONS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Signals:
    """The signals of one ramp on one axis; NaN where a signal is not known.

    Parameters
    ----------
    axis : (M,) float
        Fast time in us, or range in m.
    received, true_object, object_estimate, interference, cleaned : (M,) float
        Level in dB, or real part.
    """

    axis: FloatArray
    received: FloatArray
    true_object: FloatArray
    object_estimate: FloatArray
    interference: FloatArray
    cleaned: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Progress:
    """Scalars over iterations.

    Parameters
    ----------
    iterations : (I,) int
        Iteration numbers.
    elbo : (I,) float
        Evidence lower bound in nats.
    noise_db : (I,) float
        Noise power 1/lambda in dB.
    ratio_db : (I,) float
        Condition (27) in dB; NaN where undefined.
    """

    iterations: FloatArray
    elbo: FloatArray
    noise_db: FloatArray
    ratio_db: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """All that is drawn of one iteration.

    Parameters
    ----------
    backdrop : Backdrop
        What stays during a run.
    run_number, iteration, num_iterations : int
        Which run, the iteration shown, and how many there are so far.
    termination : Termination
        Whether the run has ended here, and why.
    ramp : int
        Ramp of `fast_time` and `delay`.
    fast_time_mode : str
        "level" or "real".
    fast_time, delay : Signals
        The signals of the ramp.
    objects, true_objects, added, pruned : Marks
        Components, truth, recent additions and removals.
    channel : Marks
        Interference-channel components of the ramp at their equivalent range.
    map_after : (Mp, Mn) uint8
        Range-Doppler map after cancellation.
    burst_level_db : (P,) float
        Mean level of the estimated burst of each ramp; NaN where none is modelled.
    true_ramps : (P,) bool
        Ramps that truly hold a burst.
    log : tuple of LogLine
        Oldest first.
    table : tuple of TableRow
        Sorted by distance.
    progress : Progress
        Diagnostics up to here.
    step_ms : mapping of str to float
        Milliseconds of an iteration by part of the algorithm, mean up to here.
    """

    backdrop: Backdrop
    run_number: int
    iteration: int
    num_iterations: int
    termination: Termination
    ramp: int
    fast_time_mode: str
    fast_time: Signals
    delay: Signals
    objects: Marks
    true_objects: Marks
    added: Marks
    pruned: Marks
    channel: Marks
    map_after: ByteArray
    burst_level_db: FloatArray
    true_ramps: BoolArray
    log: tuple[LogLine, ...]
    table: tuple[TableRow, ...]
    progress: Progress
    step_ms: Mapping[str, float]


def make_picture(
    backdrop: Backdrop,
    initial_state: SeparationState,
    steps: Sequence[Step],
    *,
    ramp: int = 0,
    fast_time_mode: str = "level",
    run_number: int = 0,
    num_iterations: int | None = None,
) -> Picture:
    """Make the picture of the last of `steps`, or of the initial state where there is none.

    Parameters
    ----------
    backdrop : Backdrop
        The scene.
    initial_state : SeparationState
        State of iteration 0.
    steps : sequence of Step
        Iterations 1 to the one shown.
    ramp : int
        Ramp shown, clipped to those there are.
    fast_time_mode : str
        "level" or "real".
    run_number : int
        Passed on, so that a stale picture can be told.
    num_iterations : int or None
        Iterations computed so far; None: as many as `steps`.
    """
    whole = steps[-1].state if steps else initial_state
    state = backdrop.seen(whole)
    ramp = min(max(ramp, 0), backdrop.radar.num_ramps - 1)
    signals = _ramp_signals(backdrop, state, ramp)
    return Picture(
        backdrop=backdrop,
        run_number=run_number,
        iteration=len(steps),
        num_iterations=len(steps) if num_iterations is None else num_iterations,
        termination=steps[-1].termination if steps else Termination.RUNNING,
        ramp=ramp,
        fast_time_mode=fast_time_mode,
        fast_time=_fast_time(backdrop, signals, fast_time_mode),
        delay=_signals(backdrop.ranges_m, backdrop.spectra_db(signals)),
        objects=object_marks(backdrop, state),
        true_objects=true_marks(backdrop),
        added=added_marks(backdrop, state, steps, FLASH_ITERATIONS),
        pruned=pruned_marks(backdrop, steps, FADE_ITERATIONS),
        channel=channel_marks(backdrop, state, ramp),
        map_after=backdrop.map_of(backdrop.observation.received - state.interference_signal),
        burst_level_db=_burst_levels(backdrop, state),
        true_ramps=backdrop.true_ramps,
        log=log_lines(steps, backdrop.radar),
        table=_table(backdrop, whole),
        progress=_progress(backdrop, steps),
        step_ms=_step_ms(steps),
    )


def _ramp_signals(backdrop: Backdrop, state: SeparationState, ramp: int) -> ComplexArray:
    """(5, N) received, true object, object estimate, interference, cleaned."""
    received = backdrop.observation.received[ramp]
    truth = backdrop.observation.truth
    unknown = np.full_like(received, np.nan)
    true_object = unknown if truth is None else truth.object_signal[ramp]
    interference = state.interference_signal[ramp]
    return np.stack(
        [received, true_object, state.object_signal[ramp], interference, received - interference]
    )


def _fast_time(backdrop: Backdrop, signals: ComplexArray, mode: str) -> Signals:
    values = signals.real if mode == "real" else backdrop.level_db(np.abs(signals) ** 2)
    return _signals(backdrop.times_us, values)


def _signals(axis: FloatArray, values: FloatArray) -> Signals:
    received, true_object, object_estimate, interference, cleaned = values
    return Signals(
        axis=axis,
        received=received,
        true_object=true_object,
        object_estimate=object_estimate,
        interference=interference,
        cleaned=cleaned,
    )


def _burst_levels(backdrop: Backdrop, state: SeparationState) -> FloatArray:
    power = np.mean(np.abs(state.interference_signal) ** 2, axis=1)
    modelled = np.isin(np.arange(len(power)), state.interfered_ramps)
    return np.where(modelled, backdrop.level_db(power), np.nan)


def _table(backdrop: Backdrop, state: SeparationState) -> tuple[TableRow, ...]:
    """Rows of all objects, as all antennas together tell them."""
    radar, objects = backdrop.radar, state.objects
    std = dispersion_std(objects, state.effective_precision, radar.shape)
    cell_m, cell_mps = resolution_cells(radar)
    found = Located(
        ids=tuple(int(number) for number in objects.component_ids),
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=radar.velocity_from_doppler(objects.dopplers),
        range_std_m=std.beats * radar.num_samples * cell_m,
        velocity_std_mps=std.dopplers * radar.num_ramps * cell_mps,
        snr_db=to_db(objects.component_snr),
    )
    true = backdrop.true_objects
    return table_rows(
        found, true.ranges_m, true.velocities_mps, true.snr_db, radar, _angles(backdrop, objects)
    )


def _angles(backdrop: Backdrop, objects: ObjectComponents) -> AngleColumns | None:
    """Directions of the objects, where a line of antennas tells them."""
    spacing = backdrop.antenna.spacing_wavelengths
    if backdrop.antenna.together == 1 or spacing is None:
        return None
    found = object_angles(
        objects.amplitudes.reshape(objects.num_components, -1)
        if objects.num_components
        else np.zeros((0, backdrop.antenna.together), dtype=np.complex128),
        np.real(np.diagonal(objects.covariance)),
        spacing,
    )
    return AngleColumns(
        angles_deg=found.angles_deg,
        stds_deg=found.stds_deg,
        true_deg=backdrop.true_objects.angles_deg,
    )


def _progress(backdrop: Backdrop, steps: Sequence[Step]) -> Progress:
    precision = np.array([step.state.noise_precision for step in steps])
    return Progress(
        iterations=np.arange(1.0, len(steps) + 1.0),
        elbo=np.array([step.info.elbo for step in steps]),
        noise_db=-to_db(precision * backdrop.reference_power),
        ratio_db=np.array([step.info.separability_ratio_db for step in steps]),
    )


def _step_ms(steps: Sequence[Step]) -> dict[str, float]:
    parts = summed(step.seconds_by_part for step in steps)
    return {name: 1e3 * seconds / len(steps) for name, seconds in parts.items()}
