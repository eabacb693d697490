"""Seating: how an open page of the server takes part in a lesson."""

from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qsl

import panel as pn

from vsep_app.pages import PAGES
from vsep_app.pages.base import PageBase
from vsep_app.server.lesson import Lesson, Seat, new_person
from vsep_app.teaching.experiment import Experiment
from vsep_app.widgets.lesson_notice import LessonNotice, go_to
from vsep_app.widgets.location import read_query


def seat_for(
    lesson: Lesson | None,
    address: str,
    request: Any,
    *,
    leads: bool,
    post: Callable[[Callable[[], None]], Any],
) -> tuple[Seat | None, dict[str, str]]:
    """Return the place of a page in the lesson, and the query that it opens with.

    A visitor's page begins where the lecturer is, if that is a page of this address.
    """
    query = read_query()
    if lesson is None:
        return None, query
    seat = Seat(lesson, getattr(request, "person", None) or new_person(), leads=leads, post=post)
    seat.is_shown_to_all = address in PAGES
    if not leads and seat.is_shown_to_all:
        seat.taken = lesson.start_view(address)
    if seat.taken is not None:
        theme = {key: value for key, value in query.items() if key == "theme"}
        query = theme | dict(seat.taken.query)
    return seat, query


def add_notice(shown: Any, seat: Seat | None, experiments: tuple[Experiment, ...]) -> None:
    """Let a visitor's page say above its views how the lesson is."""
    if seat is not None and not seat.leads and seat.is_shown_to_all:
        notice = LessonNotice({one.name: one for one in experiments})
        # Below the title that is not seen.
        shown.main[0].insert(1, notice.pane)
        seat.tell = notice.tell


def start(page: PageBase, seat: Seat | None) -> None:
    """Let a page begin, and take part in the lesson; called with its document locked."""
    page.start()
    location = pn.state.location
    if seat is None or location is None or not (seat.is_shown_to_all or seat.leads):
        return
    seat.begin(page, go=go_to, query=lambda: dict(parse_qsl(location.search[1:])))
    if seat.leads and seat.is_shown_to_all:
        seat.lead()
        location.param.watch(lambda _: seat.lead(), "search")
