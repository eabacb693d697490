"""Pictures of a comparison: one view for each method, in display units."""

from dataclasses import dataclass

from vsep._typing import FloatArray
from vsep.inference.core.progress import Termination
from vsep_app.model.markers import Markers, no_marks, object_marks
from vsep_app.model.picture import RunPicture
from vsep_app.model.score import Score, score_of
from vsep_app.model.static_picture import ByteArray, StaticPicture
from vsep_app.pages.compare.method_runs import MethodRun, MethodRunState
from vsep_app.pages.compare.metrics import FrameResult, MethodMetrics, judge_objects, measure_signal

_ENDS = {
    Termination.CONVERGED: "finished",
    Termination.MAX_ITERATIONS: "stopped at the limit",
    Termination.NONFINITE: "stopped, not finite",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class MethodView:
    """One method after some iterations."""

    name: str  #: The name a user calls it by.
    stage: str  #: What it does at this iteration.
    metrics: MethodMetrics  #: How it does.
    map_cleaned: ByteArray  #: (Mp, Mn) uint8: Range-Doppler map of the cleaned frame.
    profile_db: FloatArray  #: (M,) float: Delay spectrum of the cleaned first ramp.
    objects: Markers  #: Estimated objects.
    score: Score | None  #: How many of the true ones they are; None where that is not known.
    #: Peaks of earlier frames that its prior knows; None for a method without a prior.
    num_prior_peaks: int | None


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparePicture(RunPicture):
    """All that is drawn of one iteration of all methods, which have ended if it says so."""

    method_runs: tuple[MethodView, ...]  #: The methods.
    true_objects: Markers  #: The truth.
    received: MethodMetrics  #: What the frame is worth as received.
    frame_number: int  #: Which frame of the sequence.
    past: tuple[FrameResult, ...]  #: How the methods did on earlier frames.


def view_method_run(
    static_picture: StaticPicture, method_run: MethodRun, state: MethodRunState
) -> MethodView:
    """Make the view of a method from its state."""
    truth, cleaned = static_picture.observation.truth, state.cleaned
    separation, repair = state.separation, state.repair
    received = static_picture.observation.received
    metrics = MethodMetrics(
        **judge_objects(truth, separation)._asdict(),
        **measure_signal(truth, received, cleaned)._asdict(),
        num_repairs=None if repair is None else repair.iteration,
        num_detections=None if separation is None else separation.iteration,
        repair_s=state.repair_s,
        detection_s=state.detection_s,
    )
    stage = "repairs" if separation is None else "detects"
    return MethodView(
        name=method_run.name,
        stage=_ENDS.get(state.termination, stage),
        metrics=metrics,
        map_cleaned=static_picture.map_of(cleaned),
        profile_db=static_picture.spectra_db(cleaned[0]),
        objects=no_marks() if separation is None else object_marks(static_picture, separation),
        score=None if separation is None else score_of(static_picture, separation.objects),
        num_prior_peaks=method_run.num_prior_peaks,
    )
