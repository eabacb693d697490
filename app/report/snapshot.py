"""What the live view shows as a file: the report of its run so far, its frame, its numbers."""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

from app.report.recipe import Recipe
from app.report.run import carry_out
from app.report.write import report_bytes
from app.session import Snapshot
from app.work import Prepared
from vsep.files.frame import Frame, write_frame
from vsep.inference.progress import Step, Termination

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


def snapshot_recipe(shown: Snapshot[Prepared, Step], recipe: Recipe, ramp: int) -> Recipe:
    """Return the recipe of what is shown.

    Parameters
    ----------
    shown : Snapshot
        The run up to the iteration shown.
    recipe : Recipe
        Scene, estimator, and how fast time is drawn.
    ramp : int
        Ramp shown, clipped to those there are.
    """
    ended = bool(shown.steps) and shown.steps[-1].termination is not Termination.RUNNING
    return replace(
        recipe,
        plan=shown.opening.plan,
        ramp=min(ramp, shown.opening.backdrop.radar.num_ramps - 1),
        iteration=None if ended else len(shown.steps),
    )


def make_snapshot(key: str, recipe: Recipe) -> SnapshotFile:
    """Make one of the files of `KINDS`; the run is done again, for a page keeps it shortened.

    Raises
    ------
    InputError
        If the recipe does not fit.
    """
    run = carry_out(recipe)
    plan = recipe.plan
    stem = f"{plan.preset}-{plan.seed}-iteration-{len(run.steps)}"
    if key == "npz":
        named = replace(run.frame, anti_aliasing_filter=run.assumed_filter)
        content = recipe.frame.content if recipe.frame is not None else _frame_bytes(named)
        stem = f"{plan.preset}-{plan.seed}"
    else:
        content = report_bytes(run, f".{key}")
    return SnapshotFile(name=f"vsep-{stem}.{key}", kind=_MEDIA_TYPES[key], content=content)


def _frame_bytes(frame: Frame) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "frame.npz"
        write_frame(file, frame)
        return file.read_bytes()
