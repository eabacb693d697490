"""The guide: cards to choose an experiment, what to predict, what came, and why."""

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep_app.model.score import Score
from vsep_app.teaching.experiment import LIVE, Experiment
from vsep_app.teaching.question import number_of
from vsep_app.widgets.fields import field
from vsep_app.widgets.layout import at_once, heading, html_pane

PREDICT_PREFIX = "predict "
EXPERIMENT_PREFIX = "experiment "
_NONE = ""
_BUTTON = {"size": "small", "variant": "outlined", "margin": (2, 4, 6, 0)}
_SHOW, _HIDE = "Show the answer", "Hide the answer"

_VERDICTS = {True: "Right.", False: "Not so.", None: "Your answer is taken."}
_NO_NUMBER = '<p role="alert">An answer is a number, as 14.4.</p>'


def _as_told(experiment: Experiment, value: float, is_right: bool | None) -> bool | None:
    del experiment, value
    return is_right


class Guide:
    """Choice, predictions, texts and answer of the guided experiments.

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
    run : callable
        Lets the run go on, once a prediction is made.
    widgets : mapping of str to widget
        Controls by their settings, of which an experiment may show some.
    answered : callable
        Takes an experiment, the place of the prediction or the number that answers its question,
        and whether that is right, None while nobody can tell; returns whether it is.
    """

    def __init__(
        self,
        experiments: Sequence[Experiment],
        *,
        here: str,
        take: Callable[[Experiment], None],
        opened: Experiment | None = None,
        run: Callable[[], None] = lambda: None,
        widgets: Mapping[str, Any] | None = None,
        answered: Callable[[Experiment, float, bool | None], bool | None] = _as_told,
    ) -> None:
        self._answered = answered
        self._here, self._take, self._run = here, take, run
        self._widgets = widgets or {}
        self._experiments = {one.name: one for one in experiments}
        self._predicted: int | None = None
        self._score: Score | None = None
        self._is_over = False
        self.choice = field(
            pmu.Select,
            "Experiment",
            "Sets all controls for one question; the answer stays hidden until you ask for it. "
            "None: leaves the controls as they are.",
            options={"None": _NONE, **{one.title: one.name for one in experiments}},
            value=_NONE if opened is None else opened.name,
        )
        self.texts, self.answer = _text_pane(), _text_pane()
        self.controls = pn.Column(margin=0, sizing_mode="stretch_width", visible=False)
        self.ask = pmu.Button(label=_SHOW, description=f"{_SHOW} to the question.", **_BUTTON)
        self.again = pmu.Button(
            label="Start again",
            description="Start again: set all controls as the experiment wants them.",
            **_BUTTON,
        )
        self.number = field(pmu.TextInput, "Answer", "Your answer: a number.", max_length=24)
        self._asked = pn.Column(margin=0, sizing_mode="stretch_width")
        self.verdict = html_pane("teaching", sizing_mode="stretch_width", margin=(0, 16))
        self.number.param.watch(self._take_number, "value")
        self._buttons = pn.Row(margin=(0, 16))
        self.choice.param.watch(lambda _: self._begin(), "value")
        self.ask.on_click(lambda _: self._show_answer(not self.answer.visible))
        self.again.on_click(lambda _: self._begin())
        self._show()

    def layout(self) -> list[Any]:
        """Return the guide from top to bottom."""
        rows = self.texts, self._asked, self.verdict, self.controls, self._buttons, self.answer
        return [heading("Guided experiment"), self.choice, *rows]

    def open(self, experiment: Experiment | None) -> None:
        """Choose an experiment, as a click on it does; None: none."""
        self.choice.value = _NONE if experiment is None else experiment.name

    @property
    def experiment(self) -> Experiment | None:
        """The experiment that is chosen."""
        return self._experiments.get(self.choice.value)

    @property
    def awaits_prediction(self) -> bool:
        """Whether the run has to wait for somebody to say how it will end."""
        one = self.experiment
        predicts = one is not None and one.page == self._here and bool(one.staging.predictions)
        return predicts and self._predicted is None and not self._is_over

    def press(self, name: str) -> bool:
        """Do what a click on a card or a prediction means; whether it was one."""
        if name.startswith(EXPERIMENT_PREFIX):
            chosen = name.removeprefix(EXPERIMENT_PREFIX)
            if chosen.isdecimal() and 0 < int(chosen) <= len(self._experiments):
                chosen = [*self._experiments][int(chosen) - 1]
            if chosen in self._experiments:
                self.choice.value = chosen
        elif name.startswith(PREDICT_PREFIX):
            self._predict(int(name.removeprefix(PREDICT_PREFIX)))
        else:
            return False
        return True

    def finished(self, score: Score | None) -> None:
        """Take note of how the run of the experiment ended; later runs change nothing."""
        if not self._is_over and self.experiment is not None:
            self._is_over, self._score = True, score
            if self._predicted is not None and score is not None:
                held = self.experiment.staging.predictions[self._predicted].holds(score)
                self._answered(self.experiment, self._predicted, held)
            self._show()

    def _predict(self, number: int) -> None:
        experiment = self.experiment
        if experiment is None or not self.awaits_prediction:
            return
        if 0 <= number < len(experiment.staging.predictions):
            self._predicted = number
            self._answered(experiment, number, None)
            self._show()
            self._run()

    def _take_number(self, event: Any) -> None:
        """Take what was typed for an answer; what is no number is marked and counts for nothing."""
        experiment, number = self.experiment, number_of(event.new)
        self.number.error_state = bool(event.new) and number is None
        if experiment is None or number is None:
            self.verdict.object = _NO_NUMBER if event.new else ""
            return
        right = self._answered(experiment, number, None)
        self.verdict.object = f'<p role="status">{_VERDICTS[right]}</p>'

    def _begin(self) -> None:
        self._predicted, self._score, self._is_over = None, None, False
        self.number.value = ""
        experiment = self.experiment
        self._show()
        if experiment is not None and experiment.page == self._here:
            self._take(experiment)

    def _show(self) -> None:
        """Show the texts of the chosen experiment, without its answer."""
        experiment = self.experiment
        is_here = experiment is not None and experiment.page == self._here
        knows = is_here and not self.awaits_prediction
        self.texts.visible = experiment is not None
        asked = experiment.ask if experiment is not None and is_here else None
        if bool(len(self._asked)) != (asked is not None):
            self._asked[:] = [] if asked is None else [self.number]
        if asked is not None:
            unit = f" [{asked.unit}]" if asked.unit else ""
            self.number.label = f"Your answer{unit}"
        names = experiment.staging.show if experiment is not None else ()
        if knows:
            # What nobody needs yet costs the browser nothing; what stays costs nothing again.
            shown = [self._widgets[name] for name in names if name in self._widgets]
            _place({self._buttons: [self.ask, self.again], self.controls: shown})
        self._buttons.visible = knows
        self.controls.visible = knows and bool(names)
        if experiment is not None:
            self.texts.object = texts_html(
                experiment,
                here=self._here,
                predicted=self._predicted,
                is_over=self._is_over,
                score=self._score,
            )
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


def texts_html(
    experiment: Experiment,
    *,
    here: str,
    predicted: int | None = None,
    is_over: bool = False,
    score: Score | None = None,
) -> str:
    """Return what is to be read now; for another page, the way there.

    Question and what to watch come once a prediction is made, or at once if none is asked for.
    """
    setting = _paragraphs(experiment.setting)
    if experiment.page != here:
        link = escape(experiment.link, quote=True)
        return f'{setting}<p><a data-go href="{link}">Open this experiment on its own page</a></p>'
    asked = _predictions_html(experiment, predicted, is_over=is_over, score=score)
    if asked and predicted is None and not is_over:
        return setting + asked
    return (
        f"{setting}{asked}<h3>Question</h3>{_paragraphs(experiment.question)}"
        f"<h3>Watch</h3>{_paragraphs(experiment.watch)}{_asked_html(experiment)}"
    )


def _asked_html(experiment: Experiment) -> str:
    return "" if experiment.ask is None else f"<h3>Answer</h3>{_paragraphs(experiment.ask.text)}"


def _predictions_html(
    experiment: Experiment, predicted: int | None, *, is_over: bool, score: Score | None
) -> str:
    """Return the outcomes to choose from; once the run is over, with the one that came."""
    predictions = experiment.staging.predictions
    if not predictions:
        return ""
    lines = []
    for number, each in enumerate(predictions):
        came = is_over and score is not None and each.holds(score)
        looks = " chosen" * (number == predicted) + " came" * came
        free = "" if predicted is None and not is_over else " disabled"
        said = " (what happened)" * came + " (your prediction)" * (number == predicted)
        lines.append(
            f'<button class="predict{looks}" data-press="{PREDICT_PREFIX}{number}"{free}>'
            f"{escape(each.text)}{said}</button>"
        )
    if not is_over:
        told = "What will it find?" if predicted is None else "Watch what it finds."
    elif predicted is None or score is None:
        told = "" if score is None else f"{score.text}."
    else:
        right = predictions[predicted].holds(score)
        told = f"{'Right' if right else 'Not so'}: {score.text}."
    return f'<h3 aria-live="polite">Predict. {escape(told)}</h3>{"".join(lines)}'


def cards_html(experiments: Sequence[Experiment], pictures: Mapping[str, str]) -> str:
    """Return a card for each experiment, with its picture if there is one: a click opens it."""
    images = {name: f'<img alt="" src="{address}">' for name, address in pictures.items()}
    cards = "".join(
        f"<{_opens(one)}>{images.get(one.name, '')}<strong>{number}. {escape(one.title)}</strong>"
        f"<span>{escape(one.setting)}</span></{_opens(one).split()[0]}>"
        for number, one in enumerate(experiments, 1)
    )
    title = '<h2 class="panel">Experiments: predict, watch, explain</h2>'
    return f'{title}<div class="cards">{cards}</div>'


def _opens(one: Experiment) -> str:
    """Return the element of a card without its brackets: a button, or the way to another page."""
    if one.page == LIVE:
        return f'button class="experiment" data-press="{EXPERIMENT_PREFIX}{one.name}"'
    return f'a data-go class="experiment" href="{escape(one.link, quote=True)}"'


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{escape(part.strip())}</p>" for part in text.split("\n\n"))


def _place(wanted: Mapping[Any, list[Any]]) -> None:
    """Put objects into layouts, unless they stand there: even nothing done at once costs a look."""
    changed = {layout: objects for layout, objects in wanted.items() if list(layout) != objects}
    if changed:
        with at_once():
            for layout, objects in changed.items():
                layout[:] = objects


def _text_pane() -> Any:
    return html_pane("teaching", visible=False, sizing_mode="stretch_width", margin=(0, 16))
