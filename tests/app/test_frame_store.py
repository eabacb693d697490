"""Frames that one page hands to another."""

import asyncio
import io

import numpy as np
import pytest
from vsep_app.jobs.frame_store import FRAME_KEY, FrameStore, frame_of_query
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.pages.base import PageContext
from vsep_app.pages.live import Dashboard
from vsep_app.report.spec import KeptFrame
from vsep_app.widgets.location import read_query

from tests.app.conftest import until


def frame_of(size):
    return KeptFrame(name="own.npz", content=bytes(size))


def test_the_oldest_are_forgotten_and_the_last_one_never():
    frames = FrameStore(most_bytes=100)
    first, second = frames.keep(frame_of(60)), frames.keep(frame_of(60))
    assert first != second
    assert frames.find(first) is None
    assert frames.find(second).name == "own.npz"
    large = frames.keep(frame_of(500))
    assert frames.find(second) is None
    assert frames.find(large) is not None


def test_an_address_brings_its_frame_or_a_sentence():
    frames = FrameStore()
    word = frames.keep(frame_of(3))
    query = {FRAME_KEY: word, "preset": LOADED_FRAME, "speed": "30"}
    stored, rest, errors = frame_of_query(query, frames)
    assert (stored.word, stored.frame, rest, errors) == (
        word,
        frames.find(word),
        {"speed": "30"},
        [],
    )
    stored, rest, errors = frame_of_query({FRAME_KEY: "guessed"}, frames)
    assert (stored, rest) == (None, {})
    assert "no longer kept" in errors[0]
    assert frame_of_query({"snr": "3"}, frames) == (None, {"snr": "3"}, [])


@pytest.fixture
def content(frame_arrays):
    file = io.BytesIO()
    np.savez(file, **frame_arrays())
    return file.getvalue()


def test_the_live_view_begins_with_it_until_another_scene_is_chosen(content, pool, monkeypatch):
    context = PageContext(
        pool=pool, query={}, post=lambda function: function(), watched=lambda: True
    )
    word = context.shared_resources.frames.keep(KeptFrame(name="own.npz", content=content))
    context.query[FRAME_KEY] = word

    def written():
        return read_query(context.location)

    page = Dashboard(context)
    page.errors = []
    page.notify_error = page.errors.append
    monkeypatch.setattr(page.loop, "start", lambda: None)

    async def begin():
        page.start()
        await until(lambda: FRAME_KEY in written())
        assert page.errors == []
        assert page.settings.preset == LOADED_FRAME
        assert page._frame.name == "own.npz"
        assert written()[FRAME_KEY] == word
        page.settings.choose_preset("simulation-1")
        assert FRAME_KEY not in written()

    asyncio.run(begin())
