"""Notice of a lesson above the views of a visitor's page."""

from vsep_app.server.lesson import LessonState, Mode
from vsep_app.teaching.experiment import Experiment
from vsep_app.teaching.histogram import histogram_html
from vsep_app.widgets.layout import html_pane

_WORDS = {
    Mode.FREE: "",
    Mode.LED: "The lecturer leads: this page follows hers.",
    Mode.PAUSED: "The lecturer speaks: this page stands still.",
}


class LessonNotice:
    """Says who leads, and shows the answers that are to be seen.

    `experiments` are those of the server, by name.
    """

    def __init__(self, experiments: dict[str, Experiment]) -> None:
        self._experiments = experiments
        self.pane = html_pane(
            "lesson", visible=False, sizing_mode="stretch_width", margin=(2, 6), height=None
        )

    def tell(self, state: LessonState) -> None:
        """Show how the lesson is; called with the document locked."""
        words, experiment = _WORDS[state.mode], self._experiments.get(state.shown)
        html = f'<p role="status">{words}</p>' if words else ""
        if experiment is not None:
            html += histogram_html(experiment, state.answers.get(state.shown, {}), with_right=False)
        if html != self.pane.object:
            self.pane.param.update(object=html, visible=bool(html))
