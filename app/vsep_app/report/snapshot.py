"""Downloads of the live view: the report of its run so far, its frame, its numbers."""

from dataclasses import dataclass, replace

from vsep.inference.core.progress import Step, Termination
from vsep_app.jobs.frame_store import frame_bytes
from vsep_app.jobs.run_session import Snapshot
from vsep_app.jobs.tasks import Prepared
from vsep_app.report.run import execute
from vsep_app.report.spec import ReportSpec
from vsep_app.report.write import report_bytes

KINDS = {
    "html": "Page, interactive (.html)",
    "png": "Picture for print (.png)",
    "npz": "Frame file (.npz)",
    "json": "Results and settings (.json)",
}
_MEDIA_TYPES = {
    "html": "text/html",
    "png": "image/png",
    "npz": "application/octet-stream",
    "json": "application/json",
}


@dataclass(frozen=True, kw_only=True)
class SnapshotFile:
    """A file for the browser to keep: name, media type, content."""

    name: str
    kind: str
    content: bytes


def snapshot_spec(shown: Snapshot[Prepared, Step], spec: ReportSpec, ramp: int) -> ReportSpec:
    """Return the spec of what is shown: a run up to an iteration, and a ramp, if there is that.

    The spec that is given says scene, estimator, and how fast time is drawn.
    """
    ended = bool(shown.steps) and shown.steps[-1].termination is not Termination.RUNNING
    return replace(
        spec,
        plan=shown.prepared_run.plan,
        ramp=min(ramp, shown.prepared_run.static_picture.radar.num_ramps - 1),
        iteration=None if ended else len(shown.steps),
    )


def make_snapshot(key: str, spec: ReportSpec) -> SnapshotFile:
    """Make one of the files of `KINDS`; the run is done again, for a page keeps it shortened.

    Raises `InputError` if the spec does not fit.
    """
    run = execute(spec)
    plan = spec.plan
    stem = f"{plan.preset}-{plan.seed}-iteration-{len(run.steps)}"
    if key == "npz":
        named = replace(run.frame, anti_aliasing_filter=run.assumed_filter)
        content = spec.frame.content if spec.frame is not None else frame_bytes(named)
        stem = f"{plan.preset}-{plan.seed}"
    else:
        content = report_bytes(run, f".{key}")
    return SnapshotFile(name=f"vsep-{stem}.{key}", kind=_MEDIA_TYPES[key], content=content)
