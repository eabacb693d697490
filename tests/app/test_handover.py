"""Frames that one page hands to another."""

import io

import numpy as np
import pytest

from app.handover import FRAME_KEY, HandedFrames, frame_of_query
from app.page import Dashboard
from app.report.recipe import KeptFrame
from app.settings import LOADED_FRAME
from app.visit import Visit


def frame_of(size):
    return KeptFrame(name="own.npz", content=bytes(size))


def test_the_oldest_are_forgotten_and_the_last_one_never():
    frames = HandedFrames(most_bytes=100)
    first, second = frames.keep(frame_of(60)), frames.keep(frame_of(60))
    assert first != second
    assert frames.find(first) is None
    assert frames.find(second).name == "own.npz"
    large = frames.keep(frame_of(500))
    assert frames.find(second) is None
    assert frames.find(large) is not None


def test_an_address_brings_its_frame_or_a_sentence():
    frames = HandedFrames()
    word = frames.keep(frame_of(3))
    query = {FRAME_KEY: word, "preset": LOADED_FRAME, "speed": "30"}
    handed, rest, complaints = frame_of_query(query, frames)
    assert (handed.word, handed.frame, rest, complaints) == (
        word,
        frames.find(word),
        {"speed": "30"},
        [],
    )
    handed, rest, complaints = frame_of_query({FRAME_KEY: "guessed"}, frames)
    assert (handed, rest) == (None, {})
    assert "no longer kept" in complaints[0]
    assert frame_of_query({"snr": "3"}, frames) == (None, {"snr": "3"}, [])


@pytest.fixture
def content(frame_arrays):
    file = io.BytesIO()
    np.savez(file, **frame_arrays())
    return file.getvalue()


def test_the_live_view_begins_with_it_until_another_scene_is_chosen(content, monkeypatch):
    visit = Visit(pool=None, query={}, post=lambda function: function(), watched=lambda: True)
    word = visit.commons.frames.keep(KeptFrame(name="own.npz", content=content))
    visit.query[FRAME_KEY] = word
    written = {}
    monkeypatch.setattr("app.page.set_query", written.__setitem__)
    page = Dashboard(visit)
    page.complaints = []
    page.complain = page.complaints.append
    monkeypatch.setattr(page.loop, "start", lambda: None)
    page.start()
    assert page.complaints == []
    assert page.settings.preset == LOADED_FRAME
    assert page._frame.name == "own.npz"
    assert written[FRAME_KEY] == word
    page.settings.choose_preset("simulation-1")
    assert written[FRAME_KEY] is None
