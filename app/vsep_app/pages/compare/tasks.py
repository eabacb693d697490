"""The work of a comparison, as pure top-level functions that any thread or process may do.

All methods see the same frame and the same mask; one step is one iteration of every method that has
not ended.
"""

from dataclasses import dataclass, replace

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.frame import Frame
from vsep.files.frame_mask import TRUTH, frame_mask
from vsep.inference.core.progress import Termination
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS
from vsep.mitigation.sparse.prior import PriorModel
from vsep.signal.scene import Observation
from vsep_app.jobs.run_session import Snapshot
from vsep_app.jobs.tasks import MadeScene, is_simulated, make_scene, plan_estimator
from vsep_app.jobs.tasks import run_key as run_key_of_scene
from vsep_app.jobs.weak_memo import WeakMemo
from vsep_app.model.compare_settings import LAST_FRAME, ComparePlan
from vsep_app.model.markers import Markers, true_marks
from vsep_app.model.static_picture import StaticPicture, make_static_picture
from vsep_app.pages.compare.method_runs import (
    MethodRun,
    MethodRunState,
    advance_method_run,
    open_method_run,
)
from vsep_app.pages.compare.metrics import FrameResult, MethodMetrics, measure_signal
from vsep_app.pages.compare.picture import ComparePicture, MethodView, view_method_run


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """A comparison that is ready for its first step."""

    plan: ComparePlan  #: What it was made from.
    method_runs: tuple[MethodRun, ...]  #: The methods.
    initial_state: tuple[MethodRunState, ...]  #: Their states before the first iteration.
    initial_views: tuple[MethodView, ...]  #: The same as they are drawn.
    static_picture: StaticPicture  #: What all pictures share.
    true_objects: Markers  #: The truth.
    received: MethodMetrics  #: What the frame is worth as received.


@dataclass(frozen=True, kw_only=True, eq=False)
class CompareStep:
    """One iteration of all methods."""

    #: What the next step needs; empty once there is a next one, for frames are large.
    state: tuple[MethodRunState, ...]
    views: tuple[MethodView, ...]  #: What is drawn.
    termination: Termination  #: Whether all have ended; converged only if all have.


def run_key(plan: ComparePlan) -> tuple[object, ...] | None:
    """Return the name of the run of a plan; None where it is one session's own."""
    if run_key_of_scene(plan.scene) is None or plan.frame_number or plan.past:
        return None
    return "compare", plan.scene, plan.methods, plan.mask, plan.debias


# What is kept of a step for the display, and what the picture of a later one needs of it.
compact = WeakMemo[CompareStep](lambda step: replace(step, state=()))
strip = WeakMemo[CompareStep](lambda step: replace(step, state=(), views=()))


def prepare(plan: ComparePlan, loaded: Frame | None = None) -> Comparison:
    """Make the frame of a plan and the first state of each of its methods.

    Raises `InputError` if the plan cannot be carried out; the message is for the user.
    """
    scene = make_scene(plan.scene, loaded, frame_number=plan.frame_number)
    frame = scene.frame
    mask = find_mask(frame, plan.mask)
    method_runs = tuple(_method_run(plan, name, scene, mask) for name in plan.methods)
    states = tuple(open_method_run(method_run) for method_run in method_runs)
    observation = Observation(received=frame.received, truth=frame.truth)
    static_picture = make_static_picture(frame.radar, observation, title=frame.name)
    received = measure_signal(frame.truth, frame.received, frame.received)
    views = (
        view_method_run(static_picture, *pair) for pair in zip(method_runs, states, strict=True)
    )
    return Comparison(
        plan=plan,
        method_runs=method_runs,
        initial_state=states,
        initial_views=tuple(views),
        static_picture=static_picture,
        true_objects=true_marks(static_picture),
        received=MethodMetrics(**received._asdict()),
    )


def advance(comparison: Comparison, states: tuple[MethodRunState, ...]) -> CompareStep:
    """Do one iteration of every method that has not ended."""
    method_runs, static_picture = comparison.method_runs, comparison.static_picture
    after = tuple(advance_method_run(*pair) for pair in zip(method_runs, states, strict=True))
    return CompareStep(
        state=after,
        views=tuple(
            view_method_run(static_picture, *pair) for pair in zip(method_runs, after, strict=True)
        ),
        termination=_verdict([state.termination for state in after]),
    )


def compose(snapshot: Snapshot[Comparison, CompareStep]) -> ComparePicture:
    """Make the picture of a snapshot."""
    prepared_run, steps = snapshot.prepared_run, snapshot.steps
    return ComparePicture(
        static_picture=prepared_run.static_picture,
        run_number=snapshot.run_number,
        iteration=len(steps),
        num_iterations=snapshot.num_steps,
        termination=steps[-1].termination if steps else Termination.RUNNING,
        method_runs=steps[-1].views if steps else prepared_run.initial_views,
        true_objects=prepared_run.true_objects,
        received=prepared_run.received,
        frame_number=prepared_run.plan.frame_number,
        past=prepared_run.plan.past,
    )


def has_next_frame(plan: ComparePlan) -> bool:
    """Whether the sequence goes on: only simulated objects move."""
    return is_simulated(plan.scene) and plan.frame_number < LAST_FRAME


def next_plan(comparison: Comparison, last: CompareStep) -> ComparePlan:
    """Return the plan of the next frame; methods with a prior have seen the repaired one."""
    plan = comparison.plan
    histories = {
        method_run.name: prior.see(
            plan.histories.get(method_run.name, ()),
            state.observed,
            comparison.static_picture.radar.dither,
        )
        for method_run, state in zip(comparison.method_runs, last.state, strict=True)
        if (prior := _prior_of(method_run.name)) is not None
    }
    metrics = tuple(view.metrics for view in last.views)
    result = FrameResult(frame_number=plan.frame_number, method_runs=metrics)
    return replace(
        plan, frame_number=plan.frame_number + 1, histories=histories, past=(*plan.past, result)
    )


def find_mask(frame: Frame, name: str) -> BoolArray:
    """Return which samples are taken for interfered.

    Raises `InputError` if the truth is asked for and not known.
    """
    if name == TRUTH and frame.perfect_mask is None:
        raise InputError(
            f"{frame.name} holds no truth, so there is no perfect mask; choose another mask."
        )
    return frame_mask(frame, name)


def _method_run(plan: ComparePlan, name: str, scene: MadeScene, mask: BoolArray) -> MethodRun:
    frame = scene.frame
    history = plan.histories.get(name, ())
    repair = None
    if name not in ESTIMATORS:
        # One switch for all methods of the comparison: those without the setting do without.
        entry = MITIGATIONS.require(name)
        settings = {"debias": plan.debias, "history": history, "dither": frame.radar.dither}
        repair = entry.make(**entry.accepted(**settings))
    return MethodRun(
        name=name,
        received=frame.received,
        mask=mask,
        repair=repair,
        estimator=plan_estimator(
            replace(plan.scene, estimator=name if repair is None else "object-only"),
            frame.radar,
            scene.assumed_filter,
            mask=mask,
            missing=frame.missing_rows(together=False),
        ),
        num_prior_peaks=(
            None if _prior_of(name) is None else sum(int(seen.peaks.sum()) for seen in history)
        ),
    )


def _prior_of(name: str) -> PriorModel | None:
    """Return what sees the last frames of a sequence for a method; None for most."""
    return MITIGATIONS[name].prior if name in MITIGATIONS else None


def _verdict(terminations: list[Termination]) -> Termination:
    for one in (Termination.RUNNING, Termination.NONFINITE, Termination.MAX_ITERATIONS):
        if one in terminations:
            return one
    return Termination.CONVERGED
