import asyncio
import json
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from vsep_app.pages.base import PageContext
from vsep_app.pages.studies.page import StudyPage, compose
from vsep_app.pages.studies.scatter import ScatterChoice
from vsep_app.pages.studies.session import StudyPhase

from tests.app.conftest import until
from vsep.files.results import as_json
from vsep.studies.trial import run_trial


@pytest.fixture
def told(monkeypatch):
    """Sentences that the user was told."""
    sentences = []
    monkeypatch.setattr(StudyPage, "notify_error", lambda _, sentence: sentences.append(sentence))
    return sentences


@pytest.fixture
def slow_engine(monkeypatch):
    """An engine without processes, whose trials take a hundredth of a second at least."""

    def run(trials, *, workers, stop, retried):
        del workers, retried
        for trial in trials:
            if stop.is_set():
                return
            time.sleep(0.01)
            yield run_trial(trial)

    monkeypatch.setattr("vsep.studies.engine.run_on_processes", run)


def new_page():
    pool = ThreadPoolExecutor(max_workers=1)  # its thread ends with the last reference to it
    return StudyPage(
        PageContext(pool=pool, query={}, post=lambda function: function(), watched=lambda: True)
    )


def as_file(rows):
    return "".join(as_json(row) + "\n" for row in rows).encode()


def test_the_picture_has_the_curves_and_the_dots(study_rows):
    choice = ScatterChoice(study="fig-3", panel="3a", value="iterations")
    picture = compose(study_rows, choice)
    assert {panel.title.partition(";")[0] for panel in picture.panels} == {
        "Fig. 3a: over SNR at SIR 0 dB"
    }
    assert len(picture.dots.by_method["object-only"].rows) == 6
    assert len(compose((), choice).panels) == 0


@pytest.mark.usefixtures("slow_engine")
def test_a_closed_page_stops_its_study_and_removes_its_folder():
    page = new_page()
    page.form.methods.value = ["object-only"]
    page.form.realizations.value = 10_000

    async def context():
        page.start()
        await page._run(None)
        await until(lambda: page._panels)
        content = page._rows().read().splitlines()
        page.close()
        await until(lambda: not page._folder.path.exists())
        return content

    content = asyncio.run(context())
    assert json.loads(content[0])["study"] == "fig-3"
    assert page.session.snapshot().phase is StudyPhase.STOPPED


@pytest.mark.usefixtures("slow_engine")
def test_rows_that_are_opened_are_shown_and_gone_on_with(study_rows, told):
    page = new_page()

    async def context():
        page.start()
        await page.load("mine.jsonl", as_file(study_rows))
        assert page.session.snapshot().phase is StudyPhase.STOPPED
        assert page.form.methods.value == ["object-only", "no-interference"]
        await until(lambda: page._panels)
        await page._run(None)
        await until(lambda: page.session.snapshot().phase is StudyPhase.FINISHED)
        page.close()

    asyncio.run(context())
    rows = page.session.snapshot().rows
    # Panel 3a has 13 points; two of them were there.
    assert len(rows) == 3 * 13 * 2
    assert list(rows[: len(study_rows)]) == json.loads(
        json.dumps([json.loads(as_json(row)) for row in study_rows])
    )
    assert told == []


@pytest.mark.usefixtures("slow_engine")
def test_the_page_opens_on_shipped_rows_and_a_run_goes_on_from_them(told):
    page = new_page()

    async def context():
        page.start()
        await until(lambda: page._panels)
        shown = page.session.snapshot()
        page.form.methods.value = ["object-only"]
        page.form.realizations.value = 51
        await page._run(None)
        await until(lambda: page.session.snapshot().phase is StudyPhase.FINISHED)
        page.close()
        return shown

    shown = asyncio.run(context())
    assert shown.phase is StudyPhase.STOPPED
    assert {row["point"]["panel"] for row in shown.rows} == {"3a"}
    own = [row for row in shown.rows if row["method"] == "object-only"]
    # Panel 3a has 13 points, of which 50 realizations are shipped.
    assert len(own) == 13 * 50
    rows = page.session.snapshot().rows
    assert list(rows[: len(own)]) == own
    assert len(rows) == 13 * 51
    assert told == []


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"my notes\n", "Line 1 of ../mine.jsonl is no row of a study; give another file."),
        (b"\xff\xfe\n", "Line 1 of ../mine.jsonl is no row of a study; give another file."),
        (b"{", "../mine.jsonl holds no rows; run a study into it first."),
    ],
)
def test_a_file_of_something_else_is_told_and_nothing_changes(told, content, sentence):
    page = new_page()

    async def context():
        await page.load("../mine.jsonl", content)
        page.close()

    asyncio.run(context())
    assert told == [sentence]
    assert page.session is None


def test_what_the_form_refuses_is_told(told):
    page = new_page()
    page.form.panels.value = []
    asyncio.run(page._run(None))
    assert told == ["No panel is chosen; choose at least one."]
    assert page.session is None
    page.close()


def test_a_failure_to_draw_is_told_once_and_the_page_goes_on(told, study_rows, monkeypatch, caplog):
    page = new_page()
    tries = []

    def broken(rows, choice):
        tries.append(rows)
        if len(tries) < 3:
            raise KeyError("odd")
        return compose(rows, choice)

    monkeypatch.setattr("vsep_app.pages.studies.page.compose", broken)
    monkeypatch.setattr("vsep_app.pages.studies.page.MIN_PERIOD_S", 0.01)

    async def context():
        page.start()
        await page.load("mine.jsonl", as_file(study_rows))
        await until(lambda: page._panels)
        page.close()

    asyncio.run(context())
    assert told == ["The rows cannot be drawn (KeyError: 'odd')."]
    assert "the panels of a study failed" in caplog.text
