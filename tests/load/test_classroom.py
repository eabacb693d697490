"""A few sessions for a few seconds; the whole class is sent by hand, see classroom.py."""

import asyncio

from tests.load.classroom import health, lesson, served, summary


def test_a_small_class_gets_its_pictures_and_leaves_nothing_running():
    with served() as url:
        students, healths = asyncio.run(
            lesson(url, sessions=4, seconds=6.0, pause_s=(1.5, 2.5), patience_s=60.0)
        )
        figures = summary(students, healths, 0.0)
        after = health(url)
    assert figures["errors"] == []
    assert all(each.latencies and each.rate > 0.0 for each in students)
    assert after["jobs_waiting"] == 0
    assert after["workers_replaced"] == 0
