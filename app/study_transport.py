"""Run, stop, progress, download and the choice of the figure: the row above the curves."""

from collections.abc import Callable
from typing import Any

import panel as pn
import panel_material_ui as pmu

from app.layout import stylesheet
from app.study_progress import progress_text
from app.study_session import StudyPhase, StudySnapshot

_BUTTON = {"size": "small", "margin": (9, 3)}


class StudyTransport:
    """The row above the curves, and the status in the header.

    Parameters
    ----------
    run, halt : callable
        What the buttons do.
    rows : callable
        Returns the file to download.
    """

    def __init__(
        self,
        *,
        run: Callable[[Any], Any],
        halt: Callable[[Any], Any],
        rows: Callable[[], Any],
    ) -> None:
        self.run = pmu.Button(
            label="Run",
            icon="play_arrow",
            variant="contained",
            description="Run: start, or go on where the rows end.",
            **_BUTTON,
        )
        self.halt = pmu.Button(
            label="Stop",
            icon="stop",
            variant="outlined",
            disabled=True,
            description="Stop: keep all rows; trials at work are made again later.",
            **_BUTTON,
        )
        self.download = pmu.FileDownload(
            label="Rows",
            callback=rows,
            filename="rows.jsonl",
            disabled=True,
            description="Download the rows so far, as the command line writes them.",
            **_BUTTON,
        )
        # Given to the constructor it makes the widget warn of its own default.
        self.download.variant = "outlined"
        self.run.on_click(run)
        self.halt.on_click(halt)
        self.bar = pmu.LinearProgress(
            value=0,
            variant="determinate",
            sizing_mode="stretch_width",
            min_width=80,
            margin=(22, 12),
        )
        self.progress = pn.pane.HTML(
            "", margin=(15, 10), min_width=210, stylesheets=[stylesheet("study")]
        )
        self.status = pn.pane.HTML(
            _status_html(StudyPhase.STOPPED), margin=(0, 12), styles={"color": "white"}
        )
        self.figure = pmu.Select(
            label="Figure", options=[], size="small", width=360, margin=(7, 4, 0, 4)
        )

    def layout(self, style: str) -> Any:
        """Return the row."""
        return pn.Row(
            self.run,
            self.halt,
            self.download,
            self.bar,
            self.progress,
            self.figure,
            sizing_mode="stretch_width",
            styles={"min-height": "52px"},
            margin=(2, 3, 0, 3),
            stylesheets=[style],
        )

    def offer(self, titles: list[str]) -> None:
        """Offer the figures there are; the one that is shown stays if it is among them."""
        if titles != self.figure.options:
            kept = self.figure.value if self.figure.value in titles else next(iter(titles), None)
            self.figure.param.update(options=titles, value=kept)

    def show(self, snapshot: StudySnapshot, left_s: float | None) -> bool:
        """Show how far the study is; return whether it is at work."""
        busy = snapshot.phase in (StudyPhase.RUNNING, StudyPhase.STOPPING)
        self.run.disabled = busy
        self.halt.disabled = snapshot.phase is not StudyPhase.RUNNING
        self.download.disabled = not snapshot.rows
        self.bar.value = int(100 * len(snapshot.rows) / snapshot.num_rows)
        self.progress.object = f'<span class="status">{progress_text(snapshot, left_s)}</span>'
        self.status.object = _status_html(snapshot.phase)
        return busy


def _status_html(phase: StudyPhase) -> str:
    return f'<strong role="status" style="font-size:13px;white-space:nowrap">{phase.value}</strong>'
