"""A lesson: who leads, who follows, what is answered."""

import csv
import io

import pytest
from vsep_app.server.access import EntryRules
from vsep_app.server.lesson import (
    MOST_ANSWERS,
    MOST_NAME,
    Answer,
    Lesson,
    LessonState,
    Mode,
    Seat,
    View,
    answers_csv,
    new_person,
    person_of,
)
from vsep_app.server.main import CLASSROOM

from tests.app.conftest import served
from tests.app.raw_client import ask

TOKEN = "a-token-of-the-test"
HERS = View(page="./", query=(("seed", "5"), ("iteration", "3")))


class Page:
    """A page that notes what it is told."""

    def __init__(self):
        self.shown, self.held, self.query, self.prepared = [], False, {}, 0

    @property
    def seen(self):
        return View(page="./", query=tuple(self.query.items()))

    @property
    def taken(self):
        return [dict(view.query) for view in self.shown]

    def show_view(self, view):
        self.shown.append(view)

    def prepare(self):
        self.prepared += 1
        return ()

    def hold(self, held):
        self.held = held

    def glance(self):
        return None


def seated(lesson, page, *, leads=False):
    seat = Seat(lesson, new_person(), leads=leads, post=lambda function: function())
    seat.begin(page)
    return seat


@pytest.fixture
def lesson():
    return Lesson()


@pytest.fixture
def hers(lesson):
    page = Page()
    page.query = dict(HERS.query)
    page.seat = seated(lesson, page, leads=True)
    page.seat.lead()
    return page


def test_pages_of_a_class_that_is_led_prepare_one_after_the_other(lesson, hers):
    pages = [Page(), Page()]
    for page in pages:
        seated(lesson, page)
    lesson.prepare_next()
    assert [page.prepared for page in pages] == [0, 0]
    lesson.change(mode=Mode.LED)
    told = []
    for _ in range(3):
        lesson.prepare_next()
        told.append([page.prepared for page in pages])
    assert told == [[1, 0], [1, 1], [1, 1]]
    assert not hers.prepared


@pytest.mark.usefixtures("hers")
def test_nobody_follows_before_the_lecturer_leads(lesson):
    page = Page()
    seated(lesson, page)
    assert page.taken == []
    lesson.change(mode=Mode.LED)
    assert page.taken == [dict(HERS.query)]


@pytest.mark.usefixtures("hers")
def test_a_page_that_comes_late_is_in_place(lesson):
    lesson.change(mode=Mode.LED)
    page = Page()
    seated(lesson, page)
    assert page.taken == [dict(HERS.query)]


def test_every_change_of_hers_reaches_all_and_no_change_of_theirs_does(lesson, hers):
    lesson.change(mode=Mode.LED)
    pages = [Page(), Page()]
    seats = [seated(lesson, page) for page in pages]
    hers.query = {"seed": "6"}
    hers.seat.lead()
    pages[0].query = {"seed": "9"}
    seats[0].lead()
    assert [page.taken[-1] for page in pages] == [{"seed": "6"}, {"seed": "6"}]
    assert lesson.state.view == View(page="./", query=(("seed", "6"),))
    assert hers.taken == []


@pytest.mark.usefixtures("hers")
def test_a_view_is_taken_once(lesson):
    lesson.change(mode=Mode.LED)
    page = Page()
    seat = seated(lesson, page)
    seat.answer("dip", 1.0)
    lesson.change(shown="dip")
    assert len(page.taken) == 1


def test_pausing_holds_all_but_her_and_freeing_lets_them_go(lesson, hers):
    page = Page()
    seated(lesson, page)
    lesson.change(mode=Mode.PAUSED)
    assert (page.held, hers.held) == (True, False)
    lesson.change(mode=Mode.FREE)
    assert not page.held


@pytest.mark.usefixtures("hers")
def test_another_tab_of_hers_is_opened_on_all_pages(lesson):
    page = Page()
    seated(lesson, page)
    view = View(page="compare", query=(("seed", "5"),))
    lesson.change(mode=Mode.LED, view=view)
    assert page.shown == [view]
    assert view.address == "compare?seed=5"


@pytest.mark.usefixtures("hers")
def test_a_page_that_is_opened_begins_with_the_view_of_whoever_leads(lesson):
    assert lesson.start_view is None
    lesson.change(mode=Mode.PAUSED)
    assert lesson.start_view == HERS


def test_a_view_of_a_visitor_goes_to_the_page_of_the_projector(lesson, hers):
    page = Page()
    page.query = {"seed": "9"}
    assert lesson.project(seated(lesson, page).view)
    assert hers.taken == [{"seed": "9"}]
    assert not Lesson().project(HERS)


@pytest.mark.usefixtures("hers")
def test_who_has_left_follows_no_more(lesson):
    page = Page()
    seated(lesson, page).leave()
    lesson.change(mode=Mode.LED)
    assert page.taken == []
    assert lesson.visitors == []


def test_the_last_answer_of_a_person_counts_and_hers_does_not(lesson, hers):
    seat = seated(lesson, Page())
    seat.answer("dip", 0.0)
    seat.answer("dip", 2.0, True)
    hers.seat.answer("dip", 1.0)
    assert list(lesson.state.answers["dip"].values()) == [Answer(2.0, True)]


def test_a_question_takes_so_many_answers():
    state = LessonState()
    for number in range(MOST_ANSWERS + 5):
        state = state.with_answer("dip", str(number), Answer(0.0))
    assert len(state.answers["dip"]) == MOST_ANSWERS


def test_the_table_of_answers_tells_nothing_of_who_gave_them():
    state = LessonState()
    for person, value in (("zoe", 1.0), ("ada", 2.0), ("bob", 0.5)):
        state = state.with_answer("dip", person, Answer(value, value > 1.0))
    rows = list(csv.reader(io.StringIO(answers_csv(state))))
    assert rows == [
        ["experiment", "answer", "right"],
        ["dip", "0.5", "no"],
        ["dip", "1", "no"],
        ["dip", "2", "yes"],
    ]


@pytest.mark.parametrize("name", ["Ada", "Grüße; <b>", "", "x" * 400, "a\x00\nb"])
def test_a_cookie_keeps_who_somebody_is(name):
    person = new_person(name)
    assert person_of(person.cookie) == person
    assert len(person.name) <= MOST_NAME
    assert person.name.isprintable()


@pytest.mark.parametrize("cookie", ["", "abc.Ada", "x" * 500, "abcdefghijkl", "a b;c.d"])
def test_a_cookie_that_is_none_of_ours_makes_nobody(cookie):
    assert person_of(cookie) is None


@pytest.fixture(scope="module")
def room():
    with served(entry=EntryRules(token=TOKEN, with_code=True), rules=CLASSROOM) as server:
        yield server


def test_the_page_of_the_lecturer_is_for_the_owner_alone(room):
    visitor = ask(room.port, form={"token": room.access.code}).cookie
    owner = ask(room.port, f"/?token={TOKEN}").cookie
    opened = room.registry.num_opened
    for path in ("/lead", "/lead/", "/lead/ws"):
        answer = ask(room.port, path, Cookie=visitor)
        assert answer.status == 403
        assert "for whoever started the server" in answer.text
    assert room.registry.num_opened == opened
    assert ask(room.port, "/lead", Cookie=owner).status == 200
    assert ask(room.port, "/lead").status == 401


def test_without_a_class_there_is_no_page_of_a_lecturer(app_server):
    assert ask(app_server.port, "/lead").status in (403, 404)
    assert app_server.registry.lesson is None


def test_a_link_of_the_room_brings_the_code_and_asks_for_a_name(room):
    answer = ask(room.port, f"/?join={room.access.code.lower()}")
    assert answer.status == 401
    assert f'value="{room.access.code}"' in answer.text
    assert 'name="name"' in answer.text
    strange = ask(room.port, "/?join=%22%3E%3Cb%3E")
    assert 'value=""' in strange.text


def test_who_comes_in_is_known_by_the_name_that_was_typed(room):
    form = {"token": room.access.code, "name": "Ada <b>"}
    answer = ask(room.port, "/?join=whatever&seed=3", form=form)
    cookies = answer.headers.get_all("Set-Cookie")
    assert answer.headers["Location"] == "./?seed=3"
    assert len(cookies) == 2
    assert all("HttpOnly" in cookie and "SameSite=Lax" in cookie for cookie in cookies)
    held = "; ".join(cookie.partition(";")[0] for cookie in cookies)
    assert ask(room.port, "/studies", Cookie=held).status == 200
    newest = max(room.registry.open_sessions.values(), key=lambda session: session.since)
    assert newest.page.seat.person.name == "Ada <b>"
    assert not newest.page.seat.leads
