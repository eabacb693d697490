"""The work of a run, as pure top-level functions that any thread or process may do.

`prepare` makes the scene of a plan and the estimator's first state, `advance` computes one step,
`compose` makes the picture of a snapshot.
"""

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.inference.core.estimator import Estimator
from vsep.inference.core.progress import Step
from vsep.inference.core.run import guarded_step
from vsep.inference.core.state import SeparationState
from vsep.inference.registry import ESTIMATORS, make_estimator
from vsep.presets.scenes import simulate_preset
from vsep.signal.filters import (
    AntiAliasingFilter,
    ButterworthFilter,
    NoFilter,
    RaisedCosineFilter,
)
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer, Observation
from vsep.signal.simulate import add_interference
from vsep.signal.template import SignalModel
from vsep_app.assets import path
from vsep_app.jobs.run_session import Snapshot
from vsep_app.jobs.weak_memo import Once
from vsep_app.model.picture import Picture, make_picture
from vsep_app.model.settings import LOADED_FRAME, PRESETS, REAL_FRAME, Plan
from vsep_app.model.static_picture import ShownAntenna, StaticPicture, make_static_picture

REAL_FRAME_FILE = "frames/openradar_doppler_example_1.npz"
# The other radar of the real frame hits every fourth ramp, and its crossing drifts through the
# ramp by this share of its length from the first ramp of the frame to the last.
REAL_FRAME_EVERY = 4
REAL_FRAME_DRIFT = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class Prepared:
    """A run that is ready for its first step.

    Parameters
    ----------
    plan : Plan
        What it was made from.
    estimator : Estimator
        With its settings.
    observation : Observation
        The frame and, where known, its truth; the estimator sees the frame only. Of antennas that
        are separated together the rows of all, (A P, N).
    initial_state : SeparationState
        State of iteration 0.
    static_pictures : tuple of StaticPicture
        What all pictures of an antenna share: one each of those that are separated.
    num_antennas : int
        Of the frame; an estimator may take one of them only.
    """

    plan: Plan
    estimator: Estimator
    observation: Observation
    initial_state: SeparationState
    static_pictures: tuple[StaticPicture, ...]
    num_antennas: int = 1

    @property
    def static_picture(self) -> StaticPicture:
        """What pictures of the first antenna share."""
        return self.static_pictures[0]


class MadeScene(NamedTuple):
    """A frame, with truth where it is known, and the filter that an estimator is to assume."""

    frame: Frame
    assumed_filter: AntiAliasingFilter


@lru_cache(maxsize=1)
def real_frame() -> Frame:
    """Return the recorded frame that comes with the program."""
    return read_frame(path(REAL_FRAME_FILE))


def prepare(plan: Plan, loaded: Frame | None = None, antenna: int = 0) -> Prepared:
    """Make the scene of a plan and the estimator's first state.

    Parameters
    ----------
    plan : Plan
        What determines the run.
    loaded : Frame or None
        The frame the user loaded.
    antenna : int
        Which of its antennas, or the last one, for an estimator that takes one only.

    Raises
    ------
    InputError
        If the plan cannot be carried out; the message is for the user.
    """
    scene = make_scene(plan, loaded)
    frame = scene.frame
    if not is_together(plan, frame):
        frame = frame.of_antenna(min(antenna, frame.num_antennas - 1))
    estimator = plan_estimator(
        plan, frame.radar, scene.assumed_filter, num_antennas=frame.num_antennas
    )
    every = frame.received if frame.antennas is None else frame.antennas
    received = every if frame.antennas is None else estimator.model.check(every)
    return Prepared(
        plan=plan,
        estimator=estimator,
        observation=Observation(received=received, truth=frame.antennas_truth or frame.truth),
        initial_state=estimator.init(received),
        static_pictures=tuple(
            static_picture_of(frame, number) for number in range(frame.num_antennas)
        ),
        num_antennas=scene.frame.num_antennas,
    )


def is_together(plan: Plan, frame: Frame) -> bool:
    """Whether the antennas of a frame are separated together."""
    return frame.num_antennas > 1 and ESTIMATORS.require(plan.estimator).several_antennas


def static_picture_of(frame: Frame, antenna: int) -> StaticPicture:
    """Return what pictures of one antenna share, where all of a frame are separated together."""
    alone = frame.of_antenna(antenna)
    return make_static_picture(
        frame.radar,
        Observation(received=alone.received, truth=alone.truth),
        title=frame.name,
        antenna=ShownAntenna(
            number=antenna,
            together=frame.num_antennas,
            spacing_wavelengths=frame.antenna_spacing_wavelengths,
        ),
    )


def make_scene(plan: Plan, loaded: Frame | None = None, *, frame_number: int = 0) -> MadeScene:
    """Make the frame of a plan and the filter that goes with it.

    Parameters
    ----------
    plan : Plan
        What determines the scene.
    loaded : Frame or None
        The frame the user loaded.
    frame_number : int
        Which frame of a sequence; only simulated objects move.

    Raises
    ------
    InputError
        If the plan cannot be carried out; the message is for the user.
    """
    true_filter = make_filter(
        plan.filter_kind, plan.filter_cutoff, plan.filter_rolloff, plan.filter_order
    )
    measured: AntiAliasingFilter | None = None
    if plan.preset == LOADED_FRAME:
        if loaded is None:
            raise InputError("No frame is loaded; choose a preset or load a frame file.")
        frame = loaded
        true_filter = measured = loaded.assumed_filter
    else:
        make = _simulation if is_simulated(plan) else _real_frame_with_bursts
        radar, observation = make(plan, true_filter, frame_number)
        frame = Frame(
            received=observation.received,
            radar=radar,
            truth=observation.truth,
            name=PRESETS[plan.preset].label,
        )
    return MadeScene(frame=frame, assumed_filter=_assumed_filter(plan, true_filter, measured))


def is_simulated(plan: Plan) -> bool:
    """Whether objects are simulated, not recorded."""
    return plan.preset not in (LOADED_FRAME, REAL_FRAME)


def advance(prepared: Prepared, state: SeparationState) -> Step:
    """Compute the step that follows `state`."""
    return guarded_step(prepared.estimator, prepared.observation.received, state)


def compose(
    snapshot: Snapshot[Prepared, Step], ramp: int, fast_time_mode: str, antenna: int = 0
) -> Picture:
    """Make the picture of a snapshot; where there is no such antenna, of the last one."""
    static_pictures = snapshot.opening.static_pictures
    return make_picture(
        static_pictures[min(antenna, len(static_pictures) - 1)],
        snapshot.opening.initial_state,
        snapshot.steps,
        ramp=ramp,
        fast_time_mode=fast_time_mode,
        run_number=snapshot.run_number,
        num_iterations=snapshot.num_steps,
    )


def run_key(plan: Plan) -> Plan | None:
    """Return the name of the run of a plan; that of a loaded frame is nobody else's."""
    return None if plan.preset == LOADED_FRAME else plan


def _thin(step: Step) -> Step:
    state = step.state
    return replace(
        step,
        state=_with_short_numbers(
            replace(state, bursts=tuple(_with_short_numbers(burst) for burst in state.bursts)),
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


def _bare(step: Step) -> Step:
    nothing = np.zeros((0, 0), dtype=np.complex128)
    state = replace(step.state, bursts=(), object_signal=nothing, interference_signal=nothing)
    return replace(step, state=state)


# What is kept of a step for the display, and what the picture of a later one needs of it.
thin, bare = Once(_thin), Once(_bare)


def make_filter(kind: str, cutoff_mhz: float, rolloff: float, order: int) -> AntiAliasingFilter:
    """Return a filter from the units of the controls."""
    if kind == "butterworth":
        return ButterworthFilter(cutoff_hz=cutoff_mhz * 1e6, order=order)
    if kind == "none":
        return NoFilter()
    return RaisedCosineFilter(cutoff_hz=cutoff_mhz * 1e6, rolloff=rolloff)


def _assumed_filter(
    plan: Plan, true_filter: AntiAliasingFilter, measured: AntiAliasingFilter | None
) -> AntiAliasingFilter:
    if plan.assume_true_filter:
        return true_filter
    if plan.assumed_kind != "measured":
        return make_filter(
            plan.assumed_kind, plan.assumed_cutoff, plan.assumed_rolloff, plan.assumed_order
        )
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
    num_antennas: int = 1,
) -> Estimator:
    """Return the estimator of a plan, which keeps one set of settings for all estimators."""
    model = SignalModel.of_radar(radar, anti_aliasing_filter, num_antennas)
    settings = ESTIMATORS.require(plan.estimator).accepted(
        false_alarm_rate=plan.false_alarm_rate,
        object_threshold_db=plan.object_threshold_db,
        schedule=plan.schedule,
        max_iterations=plan.max_iterations,
        mask=mask,
    )
    return make_estimator(plan.estimator, model, **settings)


def _simulation(
    plan: Plan, true_filter: AntiAliasingFilter, frame_number: int
) -> tuple[ChirpSequence, Observation]:
    slope = plan.interferer_slope * 1e12
    scenario, observation = simulate_preset(
        plan.preset,
        snr_db=plan.snr_db,
        sir_db=plan.sir_db,
        seed=plan.seed,
        interference=plan.interference,
        interferer_slope_hz_per_s=slope,
        time_offset_s=_time_offset(plan.burst_shift, slope, PRESETS[plan.preset].victim_slope),
        anti_aliasing_filter=true_filter,
        interference_model=plan.interference_model,
        frame_number=frame_number,
    )
    return scenario.radar, observation


def _time_offset(shift_us: float, slope_hz_per_s: float, victim_slope: float) -> float:
    """Delay of the other radar in s that moves its crossing by `shift_us` inside the ramp."""
    return shift_us * 1e-6 * (slope_hz_per_s - victim_slope * 1e12) / slope_hz_per_s


def _real_frame_with_bursts(
    plan: Plan, true_filter: AntiAliasingFilter, _frame_number: int
) -> tuple[ChirpSequence, Observation]:
    frame = real_frame()
    if not plan.interference:
        return frame.radar, Observation(received=frame.received, truth=frame.truth)
    observation = add_interference(
        frame.radar,
        frame.received,
        (_crossing_interferer(frame.radar, plan),),
        sir_db=plan.sir_db,
        anti_aliasing_filter=true_filter,
        interference_model=plan.interference_model,
    )
    return frame.radar, observation


def _crossing_interferer(radar: ChirpSequence, plan: Plan) -> Interferer:
    """Another radar that crosses every fourth ramp near its middle, with a drift."""
    slope = plan.interferer_slope * 1e12
    difference = slope - radar.slope_hz_per_s
    ramp_s = radar.num_samples / radar.sample_rate_hz
    crossing_s = ramp_s / 2.0 + plan.burst_shift * 1e-6
    hits = -(-radar.num_ramps // REAL_FRAME_EVERY)
    drift_s = REAL_FRAME_DRIFT * ramp_s * difference / slope
    phase = 2.0 * np.pi * np.random.default_rng(plan.seed).random()
    return Interferer(
        sequence=InterfererSequence(
            start_frequency_hz=radar.start_frequency_hz - difference * crossing_s,
            slope_hz_per_s=slope,
            ramp_duration_s=ramp_s,
            ramp_period_s=REAL_FRAME_EVERY * radar.ramp_period_s + drift_s / hits,
            num_ramps=hits,
            time_offset_s=-drift_s / 2.0,
        ),
        channel=Channel(
            delays_s=np.zeros(1),
            dopplers_hz=np.zeros(1),
            weights=np.exp(1j * np.array([phase])),
        ),
    )
