"""Lesson of a classroom: what everybody is to see, who follows, and what has been answered.

The state of a lesson is immutable; `Lesson` holds the newest one and hands each to all seats. A
seat is one page of one person. The lecturer is whoever has the owner's token; her view is the
address of her page, as it is at any time.
"""

import csv
import io
import re
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol
from urllib.parse import quote, unquote, urlencode

MOST_NAME = 40
"""Characters of the name that somebody chooses."""
MOST_ANSWERS = 200
"""To one question: who comes later is not counted."""
_MOST_QUESTIONS = 100
_MOST_PERSONS = 1000
_ID_BYTES = 9
_COOKIE = re.compile(r"([\w-]{12})\.([\w.~%-]{0,480})")


class Mode(Enum):
    """How far everybody follows."""

    FREE = "free"  #: Everybody works alone.
    LED = "led"  #: All pages show the lecturer's view.
    PAUSED = "paused"  #: So they do, and nothing goes on.


@dataclass(frozen=True, kw_only=True)
class View:
    """What a page shows: its address holds it all."""

    page: str  #: A key of `vsep_app.pages.PAGES`.
    query: tuple[tuple[str, str], ...] = ()

    @property
    def address(self) -> str:
        """Address relative to the program's own."""
        return f"{self.page}?{urlencode(self.query)}" if self.query else self.page


@dataclass(frozen=True)
class Answer:
    """An answer to a question: the place of a choice, or a number."""

    value: float
    is_right: bool | None = None  #: None as long as nobody can tell.


@dataclass(frozen=True, kw_only=True)
class LessonState:
    """All that a lesson is at one time."""

    mode: Mode = Mode.FREE
    view: View | None = None  #: The lecturer's; None until she has opened a page.
    #: Answers by experiment and person.
    answers: Mapping[str, Mapping[str, Answer]] = field(default_factory=lambda: _NOTHING)
    shown: str = ""  #: The experiment whose answers everybody sees; empty: none.

    def with_answer(self, question: str, person: str, answer: Answer) -> "LessonState":
        """Return the state with an answer; the last one of a person counts."""
        given = {**self.answers.get(question, {}), person: answer}
        if len(given) > MOST_ANSWERS or len({*self.answers, question}) > _MOST_QUESTIONS:
            return self
        return replace(self, answers=MappingProxyType({**self.answers, question: given}))


_NOTHING: Mapping[str, Mapping[str, Answer]] = MappingProxyType({})


class Glance(NamedTuple):
    """A page as the lecturer sees it among all others."""

    status: str
    picture: bytes | None = None  #: A PNG file.


class Follower(Protocol):
    """What a page does in a lesson; called with its document locked."""

    @property
    def seen(self) -> View | None:
        """What it shows, None before it shows anything."""
        ...

    def show_view(self, view: View) -> None:
        """Show a view in place, whichever tab it is of."""
        ...

    def prepare(self) -> Sequence[str]:
        """Make what it may come to show, out of sight; return its addresses."""
        ...

    def hold(self, held: bool) -> None:
        """Let nothing go on until it is let go."""
        ...

    def glance(self) -> Glance | None:
        """Return the page in small, None while it shows nothing."""
        ...


class Person(NamedTuple):
    """Who sits at a browser: a number drawn at the entry, and a name or none."""

    number: str
    name: str = ""

    @property
    def cookie(self) -> str:
        """Value of the cookie that keeps number and name."""
        return f"{self.number}.{quote(self.name, safe='')}"


def new_person(name: str = "") -> Person:
    r"""Return somebody who has just come in.

    Examples
    --------
    >>> new_person("  Ada\n Lovelace ").name
    'Ada Lovelace'
    """
    words = "".join(each if each.isprintable() else " " for each in name).split()
    return Person(secrets.token_urlsafe(_ID_BYTES), " ".join(words)[:MOST_NAME])


def person_of(cookie: str) -> Person | None:
    """Return who a cookie says its bearer is; None if it is none of ours.

    Examples
    --------
    >>> person_of("abcdefghijkl.Ada%20L").name, person_of("abc")
    ('Ada L', None)
    """
    found = _COOKIE.fullmatch(cookie)
    if found is None:
        return None
    return Person(found[1], new_person(unquote(found[2], errors="replace")).name)


class Seat:
    """One page of one person.

    Parameters
    ----------
    lesson : Lesson
        Where it belongs.
    person : Person
        Whose it is.
    leads : bool
        Whether it is the lecturer's.
    post : callable
        Runs a function with the document of the page locked.
    """

    def __init__(
        self, lesson: "Lesson", person: Person, *, leads: bool, post: Callable[[Any], Any]
    ) -> None:
        self.lesson, self.person, self.leads = lesson, person, leads
        self._post = post
        self.page: Follower | None = None
        #: Says on the page how the lesson is; called with its document locked.
        self.tell: Callable[[LessonState], None] = lambda _: None
        #: The view that the page shows already, None for its own.
        self.taken: View | None = None
        #: Whether it is a page that others can follow.
        self.is_shown_to_all = True
        #: Whether the page has been asked to make what it may come to show.
        self.is_prepared = False

    def begin(self, page: Follower) -> None:
        """Take part with a page."""
        self.page = page
        self.lesson.seats[self] = None
        self.follow()

    def leave(self) -> None:
        """Take part no more."""
        self.lesson.seats.pop(self, None)

    @property
    def view(self) -> View | None:
        """What the page shows, None before it shows anything."""
        return None if self.page is None else self.page.seen

    def follow(self) -> None:
        """Have the page follow the lesson as it is by then."""
        self._post(self._follow)

    def prepare(self) -> None:
        """Have the page make what it may come to show."""
        if self.page is not None:
            self.is_prepared = True
            self._post(self.page.prepare)

    def lead(self) -> None:
        """Take note of what the lecturer's page shows."""
        if self.leads:
            self.lesson.change(view=self.view)

    def show(self, view: View) -> None:
        """Have the page show a view, whoever leads."""
        self._post(partial(self._show, view))

    def answer(self, question: str, value: float, is_right: bool | None = None) -> None:
        """Take an answer of a visitor to the question of an experiment."""
        if not self.leads:
            answer, state = Answer(value, is_right), self.lesson.state
            answered = state.with_answer(question, self.person.number, answer)
            self.lesson.change(answers=answered.answers)

    def _follow(self) -> None:
        state, page = self.lesson.state, self.page
        if page is None:
            return
        self.tell(state)
        if self.leads:
            return
        page.hold(state.mode is Mode.PAUSED)
        if state.mode is not Mode.FREE and state.view not in (None, self.taken):
            self._show(state.view)

    def _show(self, view: View) -> None:
        if self.page is not None:
            self.taken = view
            self.page.show_view(view)


class Lesson:
    """The lesson of a server, from its start to its end."""

    def __init__(self) -> None:
        self.state = LessonState()
        self.seats: dict[Seat, None] = {}
        #: Where the room finds the server, and the code that lets it in.
        self.place, self.code = "", ""
        self._numbers: dict[str, int] = {}

    def change(self, **changes: Any) -> None:
        """Go on to another state, and let all seats know."""
        state = replace(self.state, **changes)
        if state != self.state:
            self.state = state
            for seat in tuple(self.seats):
                seat.follow()

    def prepare_next(self) -> None:
        """Have one more page of a class that is led make what it may come to show.

        All at once would hold up what the lecturer does meanwhile.
        """
        if self.state.mode is not Mode.FREE:
            for seat in [each for each in self.visitors if not each.is_prepared][:1]:
                seat.prepare()

    def number_of(self, person: Person) -> int:
        """Return the number of somebody, which lasts as long as the lesson."""
        if len(self._numbers) < _MOST_PERSONS:
            self._numbers.setdefault(person.number, len(self._numbers) + 1)
        return self._numbers.get(person.number, _MOST_PERSONS)

    @property
    def visitors(self) -> list[Seat]:
        """Pages of all but the lecturer, in the order in which they came."""
        return [seat for seat in tuple(self.seats) if not seat.leads]

    def project(self, view: View) -> bool:
        """Have the lecturer's page show a view, as that of a visitor; whether she has one open."""
        own = [seat for seat in tuple(self.seats) if seat.leads and seat.is_shown_to_all]
        fitting = [seat for seat in own if seat.view is not None and seat.view.page == view.page]
        for seat in (fitting or own)[-1:]:
            seat.show(view)
        return bool(own)

    @property
    def start_view(self) -> View | None:
        """The view that a page of a visitor begins with, None for its own address."""
        return None if self.state.mode is Mode.FREE else self.state.view


def answers_csv(state: LessonState) -> str:
    """Return all answers as a table without names, and in an order that tells nothing of them.

    Examples
    --------
    >>> print(answers_csv(LessonState().with_answer("dip", "ada", Answer(1.0, True))), end="")
    experiment,answer,right
    dip,1,yes
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["experiment", "answer", "right"])
    for question, given in sorted(state.answers.items()):
        rows = [(each.value, _WORDS[each.is_right]) for each in given.values()]
        writer.writerows((question, f"{value:.10g}", right) for value, right in sorted(rows))
    return file.getvalue()


_WORDS = {True: "yes", False: "no", None: ""}
