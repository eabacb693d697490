"""Seating: how an open page of the server takes part in a lesson."""

from collections.abc import Callable
from typing import Any

import panel as pn

from vsep_app.pages import PAGES
from vsep_app.pages.base import PageBase
from vsep_app.server.lesson import Lesson, Seat, View, new_person
from vsep_app.widgets.location import read_query


def seat_for(
    lesson: Lesson | None,
    address: str,
    request: Any,
    *,
    leads: bool,
    post: Callable[[Callable[[], None]], Any],
) -> tuple[Seat | None, View]:
    """Return the place of a page in the lesson, and the view that it opens with.

    A visitor's page begins where the lecturer is.
    """
    query = read_query(pn.state.location)
    asked = View(page=address, query=tuple(query.items()))
    if lesson is None:
        return None, asked
    seat = Seat(lesson, getattr(request, "person", None) or new_person(), leads=leads, post=post)
    seat.is_shown_to_all = address in PAGES
    if not leads and seat.is_shown_to_all:
        seat.taken = lesson.start_view
    if seat.taken is None:
        return seat, asked
    theme = {key: value for key, value in query.items() if key == "theme"}
    return seat, View(page=seat.taken.page, query=tuple((theme | dict(seat.taken.query)).items()))


def start(page: PageBase, seat: Seat | None) -> None:
    """Let a page begin, and take part in the lesson; called with its document locked."""
    page.start()
    if seat is not None and (seat.is_shown_to_all or seat.leads):
        seat.begin(page)
        if seat.is_shown_to_all:
            seat.lead()
