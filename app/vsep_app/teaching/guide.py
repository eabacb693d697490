"""The guide at the top of the side bar: an experiment's texts, and its answer once it is wanted."""

from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep_app.teaching.experiment import EXPERIMENT_KEY, Experiment
from vsep_app.widgets.fields import field
from vsep_app.widgets.layout import heading, html_pane
from vsep_app.widgets.location import set_query

_NONE = ""
_BUTTON = {"size": "small", "variant": "outlined", "margin": (2, 4, 6, 0)}
_SHOW, _HIDE = "Show the answer", "Hide the answer"


class Guide:
    """Select, texts and answer of the guided experiments.

    Parameters
    ----------
    experiments : sequence of Experiment
        Those that can be chosen.
    here : str
        Address of the page; experiments for another page are offered as links.
    take : callable
        Sets the controls as an experiment wants them.
    opened : Experiment or None
        The one that the address names; its values are set already.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        *,
        here: str,
        take: Callable[[Experiment], None],
        opened: Experiment | None = None,
    ) -> None:
        self._here, self._take = here, take
        self._experiments = {one.name: one for one in experiments}
        self.choice = field(
            pmu.Select,
            "Experiment",
            "Sets all controls for one question; the answer stays hidden until you ask for it. "
            "None: leaves the controls as they are.",
            options={"None": _NONE, **{one.title: one.name for one in experiments}},
            value=_NONE if opened is None else opened.name,
        )
        self.texts, self.answer = _text_pane(), _text_pane()
        self.ask = pmu.Button(label=_SHOW, description=f"{_SHOW} to the question.", **_BUTTON)
        self.again = pmu.Button(
            label="Start again",
            description="Start again: set all controls as the experiment wants them.",
            **_BUTTON,
        )
        self._buttons = pn.Row(self.ask, self.again, margin=(0, 16))
        self.choice.param.watch(self._chosen, "value")
        self.ask.on_click(lambda _: self._show_answer(not self.answer.visible))
        self.again.on_click(lambda _: self._begin())
        self._show()

    def layout(self) -> list[Any]:
        """Return the guide from top to bottom."""
        return [heading("Guided experiment"), self.choice, self.texts, self._buttons, self.answer]

    @property
    def experiment(self) -> Experiment | None:
        """The experiment that is chosen."""
        return self._experiments.get(self.choice.value)

    def write_address(self) -> None:
        """Put the experiment into the address of the page."""
        set_query(EXPERIMENT_KEY, self.choice.value or None)

    def _chosen(self, _: Any) -> None:
        self._show()
        self.write_address()
        self._begin()

    def _begin(self) -> None:
        experiment = self.experiment
        if experiment is not None and experiment.page == self._here:
            self._take(experiment)

    def _show(self) -> None:
        """Show the texts of the chosen experiment, without its answer."""
        experiment = self.experiment
        self.texts.visible = experiment is not None
        self._buttons.visible = experiment is not None and experiment.page == self._here
        if experiment is not None:
            self.texts.object = texts_html(experiment, here=self._here)
        self._show_answer(False)

    def _show_answer(self, wanted: bool) -> None:
        """Show the answer or take it away: until it is asked for, the page does not hold it."""
        experiment = self.experiment
        wanted = wanted and experiment is not None
        self.answer.object = (
            f'<div aria-live="polite"><h3>Answer</h3>{_paragraphs(experiment.answer)}</div>'
            if wanted and experiment is not None
            else ""
        )
        self.answer.visible = wanted
        label = _HIDE if wanted else _SHOW
        # A button is called by its tooltip: that begins with what the button says.
        self.ask.param.update(label=label, description=f"{label} to the question.")


def texts_html(experiment: Experiment, *, here: str) -> str:
    """Return setting, question and what to watch; for another page, the way there."""
    setting = _paragraphs(experiment.setting)
    if experiment.page != here:
        link = escape(experiment.link, quote=True)
        return f'{setting}<p><a href="{link}">Open this experiment on its own page</a></p>'
    return (
        f"{setting}<h3>Question</h3>{_paragraphs(experiment.question)}"
        f"<h3>Watch</h3>{_paragraphs(experiment.watch)}"
    )


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{escape(part.strip())}</p>" for part in text.split("\n\n"))


def _text_pane() -> Any:
    return html_pane("teaching", visible=False, sizing_mode="stretch_width", margin=(0, 16))
