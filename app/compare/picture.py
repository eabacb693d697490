"""What the compare page draws: one view for each method, in display units."""

from dataclasses import dataclass

from app.backdrop import Backdrop, ByteArray
from app.compare.lanes import Lane, LaneState
from app.compare.metrics import FrameResult, LaneMetrics, judge_objects, measure_signal
from app.marks import Marks, no_marks, object_marks
from vsep._arrays import FloatArray
from vsep.inference.progress import Termination

_ENDS = {
    Termination.CONVERGED: "finished",
    Termination.MAX_ITERATIONS: "stopped at the limit",
    Termination.NONFINITE: "stopped, not finite",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneView:
    """One method after some iterations.

    Parameters
    ----------
    name : str
        The name a user calls it by.
    stage : str
        What it does at this iteration.
    metrics : LaneMetrics
        How it does.
    map_cleaned : (Mp, Mn) uint8
        Range-Doppler map of the cleaned frame.
    profile_db : (M,) float
        Delay spectrum of the cleaned first ramp.
    objects : Marks
        Estimated objects.
    num_prior_peaks : int or None
        Peaks of earlier frames that its prior knows; None for a method without a prior.
    """

    name: str
    stage: str
    metrics: LaneMetrics
    map_cleaned: ByteArray
    profile_db: FloatArray
    objects: Marks
    num_prior_peaks: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparePicture:
    """All that is drawn of one iteration of all methods.

    Parameters
    ----------
    backdrop : Backdrop
        What stays during a run.
    run_number, iteration, num_iterations : int
        Which run, the iteration shown, and how many there are so far.
    termination : Termination
        Whether all methods have ended here.
    lanes : tuple of LaneView
        The methods.
    true_objects : Marks
        The truth.
    received : LaneMetrics
        What the frame is worth as received.
    frame_number : int
        Which frame of the sequence.
    past : tuple of FrameResult
        How the methods did on earlier frames.
    """

    backdrop: Backdrop
    run_number: int
    iteration: int
    num_iterations: int
    termination: Termination
    lanes: tuple[LaneView, ...]
    true_objects: Marks
    received: LaneMetrics
    frame_number: int
    past: tuple[FrameResult, ...]


def view_lane(backdrop: Backdrop, lane: Lane, state: LaneState) -> LaneView:
    """Make the view of a method from its state."""
    truth, cleaned = backdrop.observation.truth, state.cleaned
    separation, repair = state.separation, state.repair
    verdict, signal = judge_objects(truth, separation), measure_signal(truth, cleaned)
    metrics = LaneMetrics(
        misses=verdict.misses,
        false_alarms=verdict.false_alarms,
        windowed_error_db=signal.windowed_error_db,
        sinr_db=signal.sinr_db,
        num_repairs=None if repair is None else repair.iteration,
        num_detections=None if separation is None else separation.iteration,
        repair_s=state.repair_s,
        detection_s=state.detection_s,
    )
    stage = "repairs" if separation is None else "detects"
    return LaneView(
        name=lane.name,
        stage=_ENDS.get(state.termination, stage),
        metrics=metrics,
        map_cleaned=backdrop.map_of(cleaned),
        profile_db=backdrop.spectra_db(cleaned[0]),
        objects=no_marks() if separation is None else object_marks(backdrop, separation),
        num_prior_peaks=lane.num_prior_peaks,
    )
