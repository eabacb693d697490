"""The lecturer's page: who is there, what everybody sees, and what has been answered."""

import asyncio
import base64
import io
from html import escape
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep._optional import require_library
from vsep_app.model.text import counted
from vsep_app.pages import LEAD, PAGES
from vsep_app.pages.base import PageBase, PageContext, framed, links
from vsep_app.server.lesson import Lesson, LessonState, Mode, Seat, View, answers_csv
from vsep_app.teaching.experiment import EXPERIMENT_KEY
from vsep_app.teaching.help import Help
from vsep_app.teaching.histogram import asking, histogram_html
from vsep_app.widgets.fields import field, tool_button
from vsep_app.widgets.layout import (
    download_button,
    heading,
    html_pane,
    main_part,
    panel,
    stack,
    status_html,
    status_pane,
    stylesheet,
)

REFRESH_S = 1.0
"""Time between two looks at all pages; answers are shown as they come."""
_NONE = ""
_MODES = {
    "Free": Mode.FREE.value,
    "Everybody to my view": Mode.LED.value,
    "Pause": Mode.PAUSED.value,
}
_MODE_HELP = (
    "Free: everybody works alone. Everybody to my view: all pages show what your own page shows, "
    "its settings, iteration and tab, whenever that changes. Pause: so they do, and stand still."
)
_NO_PAGE = "Open the live view in another tab first: that is what the projector shows."


class LeadPage(PageBase):
    """The page of whoever leads a lesson."""

    address = "lead"

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.lesson = Lesson() if context.seat is None else context.seat.lesson
        self._experiments = {one.name: one for one in context.experiments}
        self._pictures: dict[Seat, tuple[str, bytes | None, str]] = {}
        self.mode = pmu.RadioButtonGroup(
            label="Everybody",
            description=_MODE_HELP,
            options=_MODES,
            value=self.lesson.state.mode.value,
            margin=(8, 12),
            sizing_mode="stretch_width",
        )
        self.experiment = field(
            pmu.Select,
            "Experiment for everybody",
            "Opens an experiment on all pages, yours too, and leads there.",
            options={"None": _NONE, **{one.title: one.name for one in context.experiments}},
            value=_NONE,
        )
        self.question = field(
            pmu.Select,
            "Answers to",
            "Shows here the answers to the question of an experiment.",
            options={one.title: one.name for one in asking(context.experiments)},
        )
        self.shows_answers = field(
            pmu.Switch, "Show the answers to everybody", "Shows the bars on all pages.", value=False
        )
        self.visitor = field(
            pmu.Select,
            "View of",
            "Whose view your own page, that of the projector, takes over.",
            options={},
        )
        self.project = tool_button(
            "Show on the projector",
            "present_to_all",
            "Show on the projector: the view of a visitor.",
        )
        self.answers_file = download_button(
            "Answers as CSV",
            "answers.csv",
            self._answers_file,
            "Answers as CSV: all of this lesson, without names. They are kept nowhere else.",
        )
        self.status = status_pane("")
        self.wall, self.answers = (
            html_pane("lesson", margin=(4, 10), styles={"overflow": "auto"}) for _ in range(2)
        )
        self.mode.param.watch(lambda event: self.lesson.change(mode=Mode(event.new)), "value")
        self.experiment.param.watch(self._open_experiment, "value")
        self.question.param.watch(self._show_answers, "value")
        self.shows_answers.param.watch(self._show_answers, "value")
        self.project.on_click(lambda _: self._project())

    def page(self) -> Any:
        """Return the whole page."""
        pages = " · ".join(
            f'<a href="{page.address}" target="_blank">{page.name}</a>' for page in PAGES.values()
        )
        own = html_pane(
            "lesson",
            f"<p>Your own page, which all follow: {pages}</p>",
            sizing_mode="stretch_width",
            margin=(0, 10),
        )
        join = html_pane("lesson", self._join_html(), sizing_mode="stretch_width", margin=(4, 10))
        sidebar = [
            heading("Lead"),
            self.experiment,
            heading("Projector"),
            self.visitor,
            self.project,
            heading("Answers"),
            self.question,
            self.shows_answers,
            self.answers_file,
        ]
        views = main_part(
            LEAD.title,
            self.mode,
            own,
            stack(
                panel("Join", join, weight=1),
                panel("Answers", self.answers, weight=2),
                row=True,
                flex="0 0 262px",
            ),
            panel("Everybody's maps", self.wall, weight=1),
        )
        guidance = Help(lambda: [*sidebar, views])
        self.status.param.update(align="center", stylesheets=[stylesheet("header")])
        return framed(
            self.address,
            "The lecturer's page.",
            guidance,
            header=[links(self.address), guidance.button, pn.HSpacer(), self.status],
            sidebar=sidebar,
            main=views,
        )

    def start(self) -> None:
        """Begin to look at all pages."""
        self._refresh()
        _set(self.answers, self._answers_html())
        if self.seat is not None:
            self.seat.tell = self._tell
        self._context.background.begin(self._look())

    def close(self) -> None:
        """Look no more."""
        self._context.background.close()

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(REFRESH_S)
            if self._context.watched():
                self._context.post(self._refresh)
                self.lesson.prepare_next()

    def _refresh(self) -> None:
        """Show who is there, all maps and the answers; called with the document locked."""
        visitors = self.lesson.visitors
        names = self._names()
        self._pictures = {seat: self._picture(seat) for seat in visitors}
        with pn.io.hold():
            _set(self.status, status_html(counted(len(visitors), "page")))
            if list(self.visitor.options) != list(names):
                kept = self.visitor.value if self.visitor.value in names else None
                self.visitor.param.update(options=list(names), value=kept)
            _set(self.wall, self._wall_html(names))

    def _tell(self, state: LessonState) -> None:
        """Show mode and answers at once; called with the document locked."""
        if self.mode.value != state.mode.value:
            self.mode.value = state.mode.value
        _set(self.answers, self._answers_html())

    def _names(self) -> dict[str, Seat]:
        """Return all pages by what they are called: a number, and the name or none."""
        return {
            f"{self.lesson.number_of(seat.person)} {seat.person.name}".strip(): seat
            for seat in self.lesson.visitors
        }

    def _picture(self, seat: Seat) -> tuple[str, bytes | None, str]:
        """Return the status of a page, its picture, and that as text."""
        glance = None if seat.page is None else seat.page.glance()
        status, picture = ("opens", None) if glance is None else glance
        before = self._pictures.get(seat)
        if before is not None and before[1] == picture:
            return status, picture, before[2]
        text = "" if picture is None else base64.b64encode(picture).decode()
        return status, picture, text

    def _wall_html(self, names: dict[str, Seat]) -> str:
        items = []
        for name, seat in names.items():
            status, _, text = self._pictures[seat]
            page = "" if seat.view is None else PAGES[seat.view.page].name
            image = f'<img alt="" src="data:image/png;base64,{text}">' if text else ""
            told = f"<span>{page}: {escape(status)}</span>"
            items.append(f"<li><strong>{escape(name)}</strong>{image}{told}</li>")
        return f'<ul class="wall">{"".join(items)}</ul>' if items else "Nobody is there yet."

    def _answers_html(self) -> str:
        experiment = self._experiments.get(self.question.value)
        if experiment is None:
            return ""
        given = self.lesson.state.answers.get(experiment.name, {})
        return histogram_html(experiment, given, with_right=True)

    def _join_html(self) -> str:
        """Return address and code, and both as a picture for a telephone."""
        place, code = self.lesson.place, self.lesson.code
        location = pn.state.location
        host = "" if location is None else location.hostname
        if location is not None and host and host not in ("localhost", "127.0.0.1", "::1"):
            place = location.href.partition("?")[0].rpartition("/")[0] + "/"
        if not code:
            return f"<p>{escape(place)}</p>"
        qr = require_library("segno", "The code for telephones", "dashboard")
        picture = qr.make(f"{place}?join={code}", micro=False).svg_inline(border=2, omitsize=True)
        return (
            f'<div class="join">{picture}<div><p>{escape(place)}</p><p class="code">{code}</p>'
            "</div></div>"
        )

    def _open_experiment(self, event: Any) -> None:
        experiment = self._experiments.get(event.new)
        if experiment is None:
            return
        view = View(page=experiment.page, query=((EXPERIMENT_KEY, experiment.name),))
        self.lesson.project(view)
        self.lesson.change(mode=Mode.LED, view=view)
        self.mode.value = Mode.LED.value
        if experiment.name in self.question.values:
            self.question.value = experiment.name

    def _show_answers(self, _: Any) -> None:
        self.lesson.change(shown=self.question.value if self.shows_answers.value else "")
        _set(self.answers, self._answers_html())

    def _project(self) -> None:
        seat = self._names().get(self.visitor.value or "")
        view = None if seat is None else seat.view
        if view is None:
            self.notify_error("Choose whose view is to be shown.")
        elif not self.lesson.project(view):
            self.notify_error(_NO_PAGE)

    def _answers_file(self) -> io.StringIO:
        return io.StringIO(answers_csv(self.lesson.state))


def _set(pane: Any, html: str) -> None:
    if pane.object != html:
        pane.object = html
