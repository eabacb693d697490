"""The work of a comparison, as pure top-level functions that any thread or process may do.

All methods see the same frame and the same mask; one step is one iteration of every method that has
not ended.
"""

from dataclasses import dataclass, replace

from app.backdrop import Backdrop, make_backdrop
from app.compare.lanes import Lane, LaneState, advance_lane, open_lane
from app.compare.metrics import FrameResult, LaneMetrics, measure_signal
from app.compare.picture import ComparePicture, LaneView, view_lane
from app.compare.settings import LAST_FRAME, ComparePlan
from app.marks import Marks, true_marks
from app.session import Snapshot
from app.thinning import Once
from app.work import MadeScene, is_simulated, make_estimator, make_scene
from app.work import run_key as run_key_of_scene
from vsep._arrays import BoolArray, InputError
from vsep.files.frame import Frame
from vsep.files.frame_mask import TRUTH, frame_mask
from vsep.inference.estimators import ESTIMATORS
from vsep.inference.progress import Termination
from vsep.mitigation.registry import PRIORS, make_mitigation
from vsep.signal.scene import Observation


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """A comparison that is ready for its first step.

    Parameters
    ----------
    plan : ComparePlan
        What it was made from.
    lanes : tuple of Lane
        The methods.
    initial_state : tuple of LaneState
        Their states before the first iteration.
    initial_views : tuple of LaneView
        The same as they are drawn.
    backdrop : Backdrop
        What all pictures share.
    true_objects : Marks
        The truth.
    received : LaneMetrics
        What the frame is worth as received.
    """

    plan: ComparePlan
    lanes: tuple[Lane, ...]
    initial_state: tuple[LaneState, ...]
    initial_views: tuple[LaneView, ...]
    backdrop: Backdrop
    true_objects: Marks
    received: LaneMetrics


@dataclass(frozen=True, kw_only=True, eq=False)
class CompareStep:
    """One iteration of all methods.

    Parameters
    ----------
    state : tuple of LaneState
        What the next step needs; empty once there is a next one, for frames are large.
    views : tuple of LaneView
        What is drawn.
    termination : Termination
        Whether all have ended; converged only if all have.
    """

    state: tuple[LaneState, ...]
    views: tuple[LaneView, ...]
    termination: Termination


def run_key(plan: ComparePlan) -> tuple[object, ...] | None:
    """Return the name of the run of a plan; None where it is one session's own."""
    if run_key_of_scene(plan.scene) is None or plan.frame_number or plan.past:
        return None
    return "compare", plan.scene, plan.methods, plan.mask, plan.debias


# What is kept of a step for the display, and what the picture of a later one needs of it.
thin = Once[CompareStep](lambda step: replace(step, state=()))
bare = Once[CompareStep](lambda step: replace(step, state=(), views=()))


def prepare(plan: ComparePlan, loaded: Frame | None = None) -> Comparison:
    """Make the frame of a plan and the first state of each of its methods.

    Raises
    ------
    InputError
        If the plan cannot be carried out; the message is for the user.
    """
    scene = make_scene(plan.scene, loaded, frame_number=plan.frame_number)
    frame = scene.frame
    mask = find_mask(frame, plan.mask)
    lanes = tuple(_lane(plan, name, scene, mask) for name in plan.methods)
    states = tuple(open_lane(lane) for lane in lanes)
    observation = Observation(received=frame.received, truth=frame.truth)
    backdrop = make_backdrop(frame.radar, observation, title=frame.name)
    received = measure_signal(frame.truth, frame.received)
    views = (view_lane(backdrop, *pair) for pair in zip(lanes, states, strict=True))
    return Comparison(
        plan=plan,
        lanes=lanes,
        initial_state=states,
        initial_views=tuple(views),
        backdrop=backdrop,
        true_objects=true_marks(backdrop),
        received=LaneMetrics(
            windowed_error_db=received.windowed_error_db, sinr_db=received.sinr_db
        ),
    )


def advance(comparison: Comparison, states: tuple[LaneState, ...]) -> CompareStep:
    """Do one iteration of every method that has not ended."""
    lanes, backdrop = comparison.lanes, comparison.backdrop
    after = tuple(advance_lane(*pair) for pair in zip(lanes, states, strict=True))
    return CompareStep(
        state=after,
        views=tuple(view_lane(backdrop, *pair) for pair in zip(lanes, after, strict=True)),
        termination=_verdict([state.termination for state in after]),
    )


def compose(snapshot: Snapshot[Comparison, CompareStep]) -> ComparePicture:
    """Make the picture of a snapshot."""
    opening, steps = snapshot.opening, snapshot.steps
    return ComparePicture(
        backdrop=opening.backdrop,
        run_number=snapshot.run_number,
        iteration=len(steps),
        num_iterations=snapshot.num_steps,
        termination=steps[-1].termination if steps else Termination.RUNNING,
        lanes=steps[-1].views if steps else opening.initial_views,
        true_objects=opening.true_objects,
        received=opening.received,
        frame_number=opening.plan.frame_number,
        past=opening.plan.past,
    )


def has_next_frame(plan: ComparePlan) -> bool:
    """Whether the sequence goes on: only simulated objects move."""
    return is_simulated(plan.scene) and plan.frame_number < LAST_FRAME


def next_plan(comparison: Comparison, last: CompareStep) -> ComparePlan:
    """Return the plan of the next frame; methods with a prior have seen the repaired one."""
    plan = comparison.plan
    histories = {
        lane.name: PRIORS[lane.name].see(plan.histories.get(lane.name, ()), state.observed)
        for lane, state in zip(comparison.lanes, last.state, strict=True)
        if lane.name in PRIORS
    }
    metrics = tuple(view.metrics for view in last.views)
    result = FrameResult(frame_number=plan.frame_number, lanes=metrics)
    return replace(
        plan,
        frame_number=plan.frame_number + 1,
        histories=histories,
        past=(*plan.past, result),
    )


def find_mask(frame: Frame, name: str) -> BoolArray:
    """Return which samples are taken for interfered.

    Raises
    ------
    InputError
        If the truth is asked for and not known.
    """
    if name == TRUTH and frame.perfect_mask is None:
        raise InputError(
            f"{frame.name} holds no truth, so there is no perfect mask; choose another mask."
        )
    return frame_mask(frame, name)


def _lane(plan: ComparePlan, name: str, scene: MadeScene, mask: BoolArray) -> Lane:
    frame = scene.frame
    is_estimator = name in ESTIMATORS
    history = plan.histories.get(name, ())
    return Lane(
        name=name,
        received=frame.received,
        mask=mask,
        repair=(
            None if is_estimator else make_mitigation(name, debias=plan.debias, history=history)
        ),
        estimator=make_estimator(
            replace(plan.scene, estimator=name if is_estimator else "object-only"),
            frame.radar,
            scene.assumed_filter,
            mask=mask,
        ),
        num_prior_peaks=(
            sum(int(seen.peaks.sum()) for seen in history) if name in PRIORS else None
        ),
    )


def _verdict(terminations: list[Termination]) -> Termination:
    for one in (Termination.RUNNING, Termination.NONFINITE, Termination.MAX_ITERATIONS):
        if one in terminations:
            return one
    return Termination.CONVERGED
