"""Transport of a study: run, stop, progress, download and choice of the figure."""

from collections.abc import Callable
from typing import Any

import panel_material_ui as pmu

from vsep_app.pages.studies.session import StudyPhase, StudySnapshot
from vsep_app.widgets.fields import tool_button, tool_field
from vsep_app.widgets.layout import (
    download_button,
    html_pane,
    progress_bar,
    status_html,
    status_pane,
    toolbar,
)


class StudyTransport:
    """The row above the curves, and the status in the header.

    The buttons call `run` and `halt`; `rows` returns the file to download.
    """

    def __init__(
        self, *, run: Callable[[Any], Any], halt: Callable[[Any], Any], rows: Callable[[], Any]
    ) -> None:
        text = "Run: start, or go on where the rows end."
        self.run = tool_button("Run", "play_arrow", text, variant="contained")
        text = "Stop: keep all rows; trials at work are made again later."
        self.halt = tool_button("Stop", "stop", text, disabled=True)
        self.download = download_button(
            "Rows", "rows.jsonl", rows, "Download the rows so far, as the command line writes them."
        )
        self.download.disabled = True
        self.run.on_click(run)
        self.halt.on_click(halt)
        self.bar = progress_bar()
        self.progress = html_pane("study", margin=(15, 10), min_width=210, sizing_mode=None)
        self.status = status_pane(StudyPhase.STOPPED.value)
        text = "Which figure of the study is shown, once it has rows."
        self.figure = tool_field(pmu.Select, "Figure", text, options=[], width=360, visible=False)

    def layout(self) -> Any:
        """Return the row."""
        return toolbar(self.run, self.halt, self.download, self.bar, self.progress, self.figure)

    def offer(self, titles: list[str]) -> None:
        """Offer the figures there are; the one that is shown stays if it is among them."""
        self.figure.visible = bool(titles)
        if titles != self.figure.options:
            kept = self.figure.value if self.figure.value in titles else next(iter(titles), None)
            self.figure.param.update(options=titles, value=kept)

    def show(self, snapshot: StudySnapshot) -> bool:
        """Show how far the study is; return whether it is at work."""
        busy = snapshot.phase in (StudyPhase.RUNNING, StudyPhase.STOPPING)
        self.run.disabled = busy
        self.halt.disabled = snapshot.phase is not StudyPhase.RUNNING
        self.download.disabled = not snapshot.rows
        self.bar.value = int(100 * len(snapshot.rows) / snapshot.num_rows)
        self.progress.object = f'<span class="status">{progress_text(snapshot)}</span>'
        self.status.object = status_html(snapshot.phase.value)
        return busy


def progress_text(snapshot: StudySnapshot) -> str:
    """Return how far a study is, in one line."""
    parts = [f"{len(snapshot.rows)} of {snapshot.num_rows} rows"]
    if snapshot.num_failed:
        parts.append(f"{snapshot.num_failed} failed")
    if snapshot.left_s is not None:
        parts.append(f"{duration(snapshot.left_s)} left")
    return " · ".join(parts)


def duration(seconds: float) -> str:
    """Return a duration as people say it.

    Examples
    --------
    >>> duration(42.3), duration(600.0), duration(9000.0)
    ('42 s', '10 min', '2 h 30 min')
    """
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
