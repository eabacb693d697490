"""Everything that the views draw, as plain arrays in display units.

A `Picture` is made from the static picture of a run and the steps up to the iteration shown;
screen and report draw from the same one, so they cannot differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.analysis.angles import object_angles, without_motion
from vsep.grouping.groups import ObjectGroup, find_groups
from vsep.inference.core.progress import Step, Termination
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.inference.deviations import state_deviations
from vsep.units import to_db
from vsep_app.model import markers, text
from vsep_app.model.crossing import ALL_RAMPS, Crossing, crossing_of
from vsep_app.model.score import Score, score_of
from vsep_app.model.static_picture import ByteArray, StaticPicture

FLASH_ITERATIONS = 3
FADE_ITERATIONS = 6
NOTHING_CANCELLED = "No burst is modelled yet"


@dataclass(frozen=True, eq=False)
class Signals:
    """The signals of one ramp on one axis; NaN where a signal is not known."""

    axis: FloatArray  #: (M,) float: Fast time in us, or range in m.
    #: (M,) float: Level in dB, or real part.
    received: FloatArray
    true_object: FloatArray
    object_estimate: FloatArray
    interference: FloatArray
    cleaned: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Progress:
    """Scalars over iterations."""

    iterations: FloatArray  #: (I,) int: Iteration numbers.
    elbo: FloatArray  #: (I,) float: Evidence lower bound in nats.
    noise_db: FloatArray  #: (I,) float: Noise power 1/lambda in dB.
    ratio_db: FloatArray  #: (I,) float: Condition (27) in dB; NaN where undefined.


@dataclass(frozen=True, kw_only=True, eq=False)
class RunPicture:
    """What all pictures say of their run."""

    static_picture: StaticPicture  #: What stays during a run.
    #: Which run, the iteration shown, and how many there are so far.
    run_number: int
    iteration: int
    num_iterations: int
    termination: Termination  #: Whether the run has ended here, and why.


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture(RunPicture):
    """All that is drawn of one iteration."""

    ramp: int  #: Ramp of `fast_time` and `delay`.
    fast_time_mode: str  #: "level" or "real".
    #: The signals of the ramp.
    fast_time: Signals
    delay: Signals
    #: Components, truth, recent additions and removals.
    objects: markers.Markers
    true_objects: markers.Markers
    added: markers.Markers
    pruned: markers.Markers
    groups: markers.GroupMarks  #: Extended objects; none before the run has ended.
    targets: markers.TargetMarks | None  #: Joined lines of several transmitters, likewise.
    #: Interference-channel components of the ramp at their equivalent range.
    channel: markers.Markers
    crossing: Crossing  #: Courses of chirps over the ramps, or in the ramp's spectrogram.
    score: Score | None  #: How many objects are found; None where the true ones are not known.
    headline: str  #: What happened in this iteration, in plain words.
    is_cleaned: bool  #: Whether a burst is modelled in any ramp.
    is_corrected: bool  #: Whether errors of oscillator or receiver are taken off.
    map_after: ByteArray  #: (Mp, Mn) uint8: Range-Doppler map after cancellation.
    #: (P,) float: Mean level of the estimated burst of each ramp; NaN where none is modelled.
    burst_level_db: FloatArray
    true_ramps: BoolArray  #: (P,) bool: Ramps that truly hold a burst.
    log: tuple[text.LogLine, ...]  #: Oldest first.
    table: tuple[text.TableRow, ...]  #: Sorted by distance.
    progress: Progress  #: Diagnostics up to here.

    @property
    def is_changed(self) -> bool:
        """Whether the map after cancellation is another than the one before."""
        return self.is_cleaned or self.is_corrected

    @property
    def title_after(self) -> str:
        """Title of the map after cancellation."""
        done = ["bursts cancelled"] * self.is_cleaned + ["receiver corrected"] * self.is_corrected
        return ", ".join(["Range-Doppler", *done]) if done else NOTHING_CANCELLED


def make_picture(
    static_picture: StaticPicture,
    initial_state: SeparationState,
    steps: Sequence[Step],
    *,
    ramp: int = 0,
    fast_time_mode: str = "level",
    crossing_mode: str = ALL_RAMPS,
    run_number: int = 0,
    num_iterations: int | None = None,
) -> Picture:
    """Make the picture of the last of `steps`, or of the initial state where there is none.

    Parameters
    ----------
    static_picture : StaticPicture
        The scene.
    initial_state : SeparationState
        State of iteration 0.
    steps : sequence of Step
        Iterations 1 to the one shown.
    ramp : int
        Ramp shown, clipped to those there are.
    fast_time_mode : str
        "level" or "real".
    crossing_mode : str
        "ramps" or "spectrogram".
    run_number : int
        Passed on, so that a stale picture can be told.
    num_iterations : int or None
        Iterations computed so far; None: as many as `steps`.
    """
    whole = steps[-1].state if steps else initial_state
    state = static_picture.seen(whole)
    ramp = min(max(ramp, 0), static_picture.radar.num_ramps - 1)
    score = score_of(static_picture, whole.objects)
    termination = steps[-1].termination if steps else Termination.RUNNING
    signals = _ramp_signals(static_picture, state, ramp)
    return Picture(
        static_picture=static_picture,
        run_number=run_number,
        iteration=len(steps),
        num_iterations=len(steps) if num_iterations is None else num_iterations,
        termination=termination,
        ramp=ramp,
        fast_time_mode=fast_time_mode,
        fast_time=_fast_time(static_picture, signals, fast_time_mode),
        delay=Signals(static_picture.ranges_m, *static_picture.spectra_db(signals)),
        objects=markers.object_marks(static_picture, state),
        true_objects=markers.true_marks(static_picture),
        added=markers.added_marks(static_picture, state, steps, FLASH_ITERATIONS),
        pruned=markers.pruned_marks(static_picture, steps, FADE_ITERATIONS),
        groups=markers.group_marks(_groups(static_picture, whole, termination)),
        targets=_targets(static_picture, state, termination),
        channel=markers.channel_marks(static_picture, state, ramp),
        crossing=crossing_of(static_picture, state, ramp=ramp, mode=crossing_mode),
        score=score,
        headline=text.headline(
            steps,
            static_picture.radar,
            num_bursts=int(static_picture.true_ramps.sum()),
            num_found=state.objects.num_components,
            score=score,
        ),
        is_cleaned=bool(state.interfered_ramps),
        is_corrected=state.receiver is not None,
        map_after=static_picture.map_of(state.cleaned(static_picture.observation.received)),
        burst_level_db=_burst_levels(static_picture, state),
        true_ramps=static_picture.true_ramps,
        log=text.log_lines(steps, static_picture.radar),
        table=_table(static_picture, whole, score),
        progress=_progress(static_picture, steps),
    )


def _groups(
    static_picture: StaticPicture, state: SeparationState, termination: Termination
) -> Sequence[ObjectGroup]:
    """Return the extended objects of a run that has ended; of antennas together, of points."""
    if termination is Termination.RUNNING:
        return ()
    together = static_picture.antenna.together > 1
    received = None if together else static_picture.observation.received
    return find_groups(received, state, static_picture.radar)


def _targets(
    static_picture: StaticPicture, state: SeparationState, termination: Termination
) -> markers.TargetMarks | None:
    """Return the joined lines of a run that has ended, of the antenna shown."""
    if termination is Termination.RUNNING:
        return None
    return markers.target_marks(static_picture, static_picture.observation.received, state)


def _ramp_signals(static_picture: StaticPicture, state: SeparationState, ramp: int) -> ComplexArray:
    """(5, N) received, true object, object estimate, interference, cleaned.

    The last two are not known in a ramp without a modelled burst: nothing is cleaned there yet.
    """
    received = static_picture.observation.received[ramp]
    truth = static_picture.observation.truth
    unknown = np.full_like(received, np.nan)
    true_object = unknown if truth is None else truth.object_signal[ramp]
    modelled = ramp in state.interfered_ramps
    interference = state.interference_signal[ramp] if modelled else unknown
    corrected = state.corrected(static_picture.observation.received)[ramp]
    return np.stack(
        [received, true_object, state.object_signal[ramp], interference, corrected - interference]
    )


def _fast_time(static_picture: StaticPicture, signals: ComplexArray, mode: str) -> Signals:
    values = signals.real if mode == "real" else static_picture.level_db(np.abs(signals) ** 2)
    return Signals(static_picture.times_us, *values)


def _burst_levels(static_picture: StaticPicture, state: SeparationState) -> FloatArray:
    power = np.mean(np.abs(state.interference_signal) ** 2, axis=1)
    modelled = np.isin(np.arange(len(power)), state.interfered_ramps)
    return np.where(modelled, static_picture.level_db(power), np.nan)


def _table(
    static_picture: StaticPicture, state: SeparationState, score: Score | None
) -> tuple[text.TableRow, ...]:
    """Rows of all objects, as all antennas together tell them."""
    radar, objects = static_picture.radar, state.objects
    std = state_deviations(state, radar.shape, radar.migration)
    cell_m, cell_mps = text.resolution_cells(radar)
    found = text.Located(
        ids=tuple(int(number) for number in objects.component_ids),
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=radar.velocity_from_doppler(objects.dopplers),
        range_std_m=std.beats * radar.num_samples * cell_m,
        velocity_std_mps=std.dopplers * radar.num_ramps * cell_mps,
        snr_db=to_db(state.component_snr),
    )
    true = static_picture.true_objects
    rows = text.table_rows(
        found,
        true.ranges_m,
        true.velocities_mps,
        true.snr_db,
        radar,
        {} if score is None else score.partners,
        _angles(static_picture, objects),
    )
    if objects.curvatures is None:
        return rows
    accelerations = radar.acceleration_from_curvature(objects.curvatures).tolist()
    known: dict[int | None, float] = dict(zip(found.ids, accelerations, strict=True))
    return tuple(replace(row, acceleration_mps2=known.get(row.component_id)) for row in rows)


def _angles(static_picture: StaticPicture, objects: ObjectComponents) -> text.AngleColumns | None:
    """Directions of the objects, where a line of antennas tells them."""
    spacing = static_picture.antenna.spacing_wavelengths
    if static_picture.antenna.together == 1 or spacing is None:
        return None
    weights = objects.amplitudes.reshape(objects.num_components, static_picture.antenna.together)
    found = object_angles(
        without_motion(weights, objects.dopplers, static_picture.antenna.num_transmitters),
        np.real(np.diagonal(objects.covariance)),
        spacing,
    )
    return text.AngleColumns(
        angles_deg=found.angles_deg,
        stds_deg=found.stds_deg,
        true_deg=static_picture.true_objects.angles_deg,
    )


def _progress(static_picture: StaticPicture, steps: Sequence[Step]) -> Progress:
    precision = np.array([step.state.noise_precision for step in steps])
    return Progress(
        iterations=np.arange(1.0, len(steps) + 1.0),
        elbo=np.array([step.info.elbo for step in steps]),
        noise_db=-to_db(precision * static_picture.reference_power),
        ratio_db=np.array([step.info.separability_ratio_db for step in steps]),
    )
