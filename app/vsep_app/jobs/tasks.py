"""Tasks of a run: pure top-level functions for any thread or process.

`prepare` makes the scene of a plan and the estimator's first state, `advance` computes one step,
`compose` makes the picture of a snapshot.
"""

import io
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from vsep._typing import BoolArray, FloatArray
from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import SET_ASIDE, set_aside_same_slope
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Step
from vsep.inference.core.run import guarded_step
from vsep.inference.core.state import SeparationState
from vsep.inference.registry import ESTIMATORS, make_estimator
from vsep.presets.places import parse_places
from vsep.presets.record import RecordedPreset, SimulatedPreset
from vsep.presets.registry import PRESETS
from vsep.presets.scenes import simulate_preset
from vsep.presets.settings import chosen_filter, simulator_options
from vsep.signal.clutter import remove_static_clutter
from vsep.signal.doppler_division import ONE, DopplerDivision, known_division
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Observation
from vsep.signal.simulate import add_interference
from vsep.signal.template import SignalModel
from vsep_app.assets import path
from vsep_app.jobs.run_session import Phase, Snapshot
from vsep_app.jobs.weak_memo import WeakMemo
from vsep_app.jobs.worker import Limited
from vsep_app.model.crossing import ALL_RAMPS
from vsep_app.model.picture import Picture, make_picture
from vsep_app.model.settings import LOADED_FRAME, Plan
from vsep_app.model.sound import sound_of
from vsep_app.model.static_picture import ShownAntenna, StaticPicture, make_static_picture

# Of a frame that a visitor brings, all antennas together: 16 of 512 ramps of 1024 samples.
MAX_SAMPLES = 8 * 2**20
READ_S = 20.0
SIGNAL = "received"
NO_RUN = -1
"""Number of the run of a preview, which is none."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prepared:
    """A run that is ready for its first step."""

    plan: Plan  #: What it was made from.
    estimator: Estimator  #: With its settings.
    #: The frame and, where known, its truth; the estimator sees the frame only. Of antennas that
    #: are separated together the rows of all, (A P, N).
    observation: Observation
    initial_state: SeparationState  #: State of iteration 0.
    #: What all pictures of an antenna share: one each of those that are separated.
    static_pictures: tuple[StaticPicture, ...]
    num_antennas: int = 1  #: Of the frame; an estimator may take one of them only.

    @property
    def static_picture(self) -> StaticPicture:
        """What pictures of the first antenna share."""
        return self.static_pictures[0]


class MadeScene(NamedTuple):
    """A frame, with truth where it is known, its filter, and that which an estimator assumes."""

    frame: Frame
    true_filter: AntiAliasingFilter
    assumed_filter: AntiAliasingFilter


def require_frame_size(name: str, num_samples: int) -> None:
    """Raise `InputError` unless the samples of a frame that a visitor brings can be taken.

    Examples
    --------
    >>> require_frame_size("long.npz", 64 * 2**20)
    Traceback (most recent call last):
    vsep.errors.InputError: long.npz holds 67108864 samples; at most 8388608 are taken.
    """
    if num_samples > MAX_SAMPLES:
        raise InputError(f"{name} holds {num_samples} samples; at most {MAX_SAMPLES} are taken.")


def read_upload(name: str, content: bytes) -> Frame:
    """Read a frame file that a visitor brings; its size is judged before it is expanded."""
    with Archive(io.BytesIO(content), name) as archive:
        require_frame_size(name, archive.num_elements(SIGNAL))
    return read_frame(io.BytesIO(content), name=name)


READ_UPLOAD = Limited(function=read_upload, what="The file", seconds=READ_S, megabytes=1024)


@lru_cache(maxsize=4)
def recorded_frame(preset: RecordedPreset) -> Frame:
    """Return the frame of a recorded preset, without what stands still.

    Walls and leakage are hundreds of components, and none of them is what bursts hide.
    """
    frame = read_frame(path(preset.frame_file))
    return replace(frame, received=remove_static_clutter(frame.received, frame.name))


def prepare(plan: Plan, loaded: Frame | None = None, antenna: int = 0) -> Prepared:
    """Make the scene of a plan and the estimator's first state.

    `loaded` is the frame the user loaded, `antenna` which of its antennas, or the last one, an
    estimator takes that takes one only. Raises `InputError` if the plan cannot be carried out; the
    message is for the user.
    """
    scene = make_scene(plan, loaded)
    frame = scene.frame
    if not is_together(plan, frame):
        frame = frame.of_antenna(min(antenna, frame.num_antennas - 1))
    estimator = plan_estimator(
        plan,
        frame.radar,
        scene.assumed_filter,
        num_antennas=frame.num_antennas,
        missing=frame.missing,
    )
    every = frame.received if frame.antennas is None else frame.antennas
    received = every if frame.antennas is None else estimator.model.check(every)
    return Prepared(
        plan=plan,
        estimator=estimator,
        observation=Observation(received=received, truth=frame.antennas_truth or frame.truth),
        initial_state=estimator.init(received),
        static_pictures=tuple(
            static_picture_of(frame, number, cutoff_hz=scene.true_filter.cutoff_hz)
            for number in range(frame.num_antennas)
        ),
        num_antennas=scene.frame.num_antennas,
    )


def is_together(plan: Plan, frame: Frame) -> bool:
    """Whether the antennas of a frame are separated together."""
    return frame.num_antennas > 1 and ESTIMATORS.require(plan.estimator).several_antennas


def static_picture_of(
    frame: Frame, antenna: int, *, cutoff_hz: float | None = None
) -> StaticPicture:
    """Return what pictures of one antenna share, where all of a frame are separated together."""
    alone = frame.of_antenna(antenna)
    return make_static_picture(
        frame.radar,
        Observation(received=alone.received, truth=alone.truth),
        title=frame.name,
        cutoff_hz=cutoff_hz,
        antenna=ShownAntenna(
            number=antenna,
            together=frame.num_antennas,
            spacing_wavelengths=frame.antenna_spacing_wavelengths,
            num_transmitters=frame.num_transmitters,
            division=division_of(frame),
        ),
    )


def division_of(frame: Frame) -> DopplerDivision | None:
    """Return the transmitters that send in every ramp of a frame, where it has several."""
    return known_division(frame.settings.get("doppler_division", ONE))


def make_scene(plan: Plan, loaded: Frame | None = None, *, frame_number: int = 0) -> MadeScene:
    """Make the frame of a plan, or take the loaded one, and the filter that goes with it.

    `frame_number` is that of a sequence; only simulated objects move. Raises `InputError` if the
    plan cannot be carried out; the message is for the user.
    """
    true_filter = chosen_filter(asdict(plan), "filter")
    measured: AntiAliasingFilter | None = None
    if plan.preset == LOADED_FRAME:
        if loaded is None:
            raise InputError("No frame is loaded; choose a preset or load a frame file.")
        frame = loaded
        true_filter = measured = loaded.assumed_filter
    else:
        preset = PRESETS[plan.preset]
        observation = _observation(plan, true_filter, frame_number)
        frame = Frame(
            received=observation.received,
            radar=preset.radar,
            truth=observation.truth,
            name=preset.label,
            settings={"doppler_division": plan.doppler_division},
        )
    assumed_filter = _assumed_filter(plan, true_filter, measured)
    if plan.same_slope == SET_ASIDE:
        frame = set_aside_same_slope(frame)
    return MadeScene(frame=frame, true_filter=true_filter, assumed_filter=assumed_filter)


def is_simulated(plan: Plan) -> bool:
    """Whether objects are simulated, not recorded."""
    return isinstance(PRESETS.get(plan.preset), SimulatedPreset)


def advance(prepared: Prepared, state: SeparationState) -> Step:
    """Compute the step that follows `state`."""
    return guarded_step(prepared.estimator, prepared.observation.received, state)


def compose(
    snapshot: Snapshot[Prepared, Step],
    ramp: int,
    fast_time_mode: str,
    antenna: int = 0,
    crossing_mode: str = ALL_RAMPS,
) -> Picture:
    """Make the picture of a snapshot; where there is no such antenna, of the last one."""
    static_pictures = snapshot.prepared_run.static_pictures
    return make_picture(
        static_pictures[min(antenna, len(static_pictures) - 1)],
        snapshot.prepared_run.initial_state,
        snapshot.steps,
        ramp=ramp,
        fast_time_mode=fast_time_mode,
        crossing_mode=crossing_mode,
        run_number=snapshot.run_number,
        num_iterations=snapshot.num_steps,
    )


def preview(
    plan: Plan,
    loaded: Frame | None,
    frame_antenna: int,
    ramp: int,
    fast_time_mode: str,
    antenna: int,
    crossing_mode: str,
) -> Picture:
    """Make the picture of a plan before any iteration, for settings that are still moving."""
    prepared = prepare(plan, loaded, frame_antenna)
    first: Snapshot[Prepared, Step] = Snapshot(
        run_number=NO_RUN, prepared_run=prepared, steps=(), num_steps=0, phase=Phase.IDLE
    )
    return compose(first, ramp, fast_time_mode, antenna, crossing_mode)


def frame_sound(
    snapshot: Snapshot[Prepared, Step], antenna: int = 0, *, cleaned: bool = False
) -> FloatArray:
    """Make sound of a snapshot's frame, as received or cleaned."""
    static_pictures = snapshot.prepared_run.static_pictures
    static_picture = static_pictures[min(antenna, len(static_pictures) - 1)]
    received = static_picture.observation.received
    if not cleaned or not snapshot.steps:
        return sound_of(received)
    return sound_of(static_picture.seen(snapshot.steps[-1].state).cleaned(received))


def run_key(plan: Plan) -> Plan | None:
    """Return the name of the run of a plan; that of a loaded frame is nobody else's."""
    return None if plan.preset == LOADED_FRAME else plan


def _compact(step: Step) -> Step:
    state = step.state
    return replace(
        step,
        state=_with_short_numbers(
            replace(state, bursts=tuple(_with_short_numbers(burst) for burst in state.bursts))
        ),
    )


def _with_short_numbers(record: Any) -> Any:
    """Return a record with complex arrays of half the size: too short to go on, fine to show."""
    arrays = {each.name: getattr(record, each.name) for each in fields(record)}
    return replace(
        record,
        **{
            name: value.astype(np.complex64)
            for name, value in arrays.items()
            if isinstance(value, np.ndarray) and value.dtype == np.complex128
        },
    )


def _strip(step: Step) -> Step:
    nothing = np.zeros((0, 0), dtype=np.complex128)
    state = replace(step.state, bursts=(), object_signal=nothing, interference_signal=nothing)
    return replace(step, state=state)


# What is kept of a step for the display, and what the picture of a later one needs of it.
compact, strip = WeakMemo(_compact), WeakMemo(_strip)


def _assumed_filter(
    plan: Plan, true_filter: AntiAliasingFilter, measured: AntiAliasingFilter | None
) -> AntiAliasingFilter:
    if plan.assume_true_filter:
        return true_filter
    if plan.assumed_kind != "measured":
        return chosen_filter(asdict(plan), "assumed")
    if measured is None or measured.kind != "measured":
        raise InputError(
            "The assumed filter is measured, but no loaded frame brings one; choose another kind."
        )
    return measured


def plan_estimator(
    plan: Plan,
    radar: ChirpSequence,
    anti_aliasing_filter: AntiAliasingFilter,
    *,
    mask: BoolArray | None = None,
    missing: BoolArray | None = None,
    num_antennas: int = 1,
    interference_threshold_db: float | None = None,
) -> Estimator:
    """Return the estimator of a plan, which keeps one set of settings for all estimators."""
    model = SignalModel.of_radar(radar, anti_aliasing_filter, num_antennas)
    settings = ESTIMATORS.require(plan.estimator).accepted(
        false_alarm_rate=plan.false_alarm_rate,
        object_threshold_db=plan.object_threshold_db,
        schedule=plan.schedule,
        max_iterations=plan.max_iterations,
        range_migration=plan.range_migration,
        mask=mask,
    )
    threshold = {"interference_threshold_db": interference_threshold_db}
    return make_estimator(
        plan.estimator,
        model,
        missing=missing,
        acceleration=plan.acceleration,
        **threshold,
        **settings,
    )


def _observation(plan: Plan, true_filter: AntiAliasingFilter, frame_number: int) -> Observation:
    """Simulate the frame of a preset, or add bursts to a recorded one, which has one frame."""
    preset = PRESETS[plan.preset]
    recorded = isinstance(preset, RecordedPreset)
    options = simulator_options(asdict(plan), recorded=recorded)
    if not isinstance(preset, RecordedPreset):
        options["places"] = parse_places(plan.placed)
        _, observation = simulate_preset(
            plan.preset, anti_aliasing_filter=true_filter, frame_number=frame_number, **options
        )
        return observation
    frame = recorded_frame(preset)
    if not options.pop("interference"):
        return Observation(received=frame.received, truth=frame.truth)
    names = ("seed", "interferer_slope_hz_per_s", "burst_shift_s")
    interferer = preset.draw_interferer(*(options.pop(name) for name in names))
    return add_interference(
        frame.radar, frame.received, (interferer,), anti_aliasing_filter=true_filter, **options
    )
