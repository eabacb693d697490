"""A few sessions for a few seconds; the whole class is sent by hand, see classroom.py."""

import asyncio

import pytest
from vsep_app.server.access import EntryRules
from vsep_app.server.main import CLASSROOM

from tests.app.conftest import served as server_here
from tests.load.classroom import Student, health, lesson, served, summary
from tests.load.leading import led_lesson


@pytest.fixture(scope="module")
def attended() -> tuple[list[Student], list[dict], dict, dict]:
    """Four students, what health said meanwhile, before and after."""
    with served() as url:
        before = health(url)
        students, healths = asyncio.run(
            lesson(url, sessions=4, seconds=6.0, pause_s=(1.5, 2.5), patience_s=60.0)
        )
        return students, healths, before, health(url)


def test_a_small_class_gets_its_pictures_and_leaves_nothing_running(attended):
    students, healths, _, after = attended
    assert summary(students, healths, 0.0)["errors"] == []
    assert all(each.latencies and each.rate > 0.0 for each in students)
    assert after["jobs_waiting"] == 0
    assert after["workers_replaced"] == 0


def test_a_server_without_visitors_takes_at_most_700_mb(attended):
    *_, before, _ = attended
    assert before["workers"] == before["workers_wanted"]
    assert before["server_mb"] / 2 < before["all_mb"] <= 700.0


def test_a_small_class_follows_its_lecturer_and_answers():
    """Through two experiments; the figures of a whole class are measured by hand."""
    token = "a-token-of-the-load-test"
    with server_here(entry=EntryRules(token=token, with_code=True), rules=CLASSROOM) as server:
        led = asyncio.run(
            led_lesson(
                f"http://127.0.0.1:{server.port}/",
                token=token,
                code=server.access.code,
                sessions=1,
                rounds=1,
                pause_s=0.1,
                most=2,
            )
        )
        seats = server.registry.lesson.visitors
    assert led.unseen == []
    assert {"experiment", "another tab", "slider", "iteration", "answers"} <= led.latencies.keys()
    assert [each.errors for each in (led.desk, led.own, *led.students)] == [[]] * 3
    assert {seat.person.name for seat in seats} <= {"Student 0"}
