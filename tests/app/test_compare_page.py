"""The compare page without a browser: what it starts, and what it does with a file and a frame."""

import asyncio
import io

import numpy as np
from vsep_app.jobs.run_session import Phase
from vsep_app.model.settings import LOADED_FRAME
from vsep_app.pages.base import PageContext
from vsep_app.pages.compare.page import BLIND_MASK, ComparePage

from tests.app.conftest import until


def page_of(pool, query=()):
    context = PageContext(
        pool=pool, query=dict(query), post=lambda function: function(), watched=lambda: True
    )
    page = ComparePage(context)
    page.errors = []
    page.notify_error = page.errors.append
    return page


def test_the_address_sets_scene_and_choice(pool):
    page = page_of(pool, {"preset": "simulation-2-c", "snr": "40", "methods": "omp,joint"})
    assert (page.settings.preset, page.settings.snr_db) == ("simulation-2-c", 40.0)
    assert page.choice.methods == ["omp", "joint"]
    assert [select.value for select in page.form.methods] == ["omp", "joint", "", ""]


def test_a_choice_made_on_the_page_restarts_and_a_double_one_is_undone(pool):
    page = page_of(pool, {"methods": "omp,joint"})
    number = page.session.run_number
    page.form.methods[3].value = "zeroing"
    assert page.choice.methods == ["omp", "joint", "zeroing"]
    assert [select.value for select in page.form.methods] == ["omp", "joint", "zeroing", ""]
    assert page.session.run_number == number + 1
    page.form._notify_error = page.errors.append
    page.form.methods[0].value = "joint"
    assert page.errors == ["joint is chosen twice; the methods must differ."]
    assert page.form.methods[0].value == "omp"
    assert page.session.run_number == number + 1


def test_a_loaded_frame_without_truth_takes_a_mask_that_is_found(pool, frame_arrays):
    page = page_of(pool)
    content = io.BytesIO()
    np.savez(content, **frame_arrays())

    async def drive():
        page.load("own.npz", content.getvalue())
        await until(lambda: page.settings.preset == LOADED_FRAME)
        assert page.choice.mask == BLIND_MASK
        page.load("bad.npz", b"nothing")
        await until(lambda: page.errors)
        assert "bad.npz" in page.errors[0]

    asyncio.run(drive())


def test_frames_follow_each_other_and_a_changed_scene_begins_anew(pool):
    page = page_of(pool, {"methods": "pm-ist,zeroing", "max_iterations": "1", "speed": "30"})

    async def drive():
        page.loop.start()
        page._restart()
        await until(lambda: page.session.phase is Phase.FINISHED)
        page.next_frame()
        await until(lambda: page.session.phase is Phase.FINISHED and page.session.prepared_run)
        plan = page.session.prepared_run.plan
        assert (plan.frame_number, set(plan.histories)) == (1, {"pm-ist"})
        page.settings.seed = 8
        await until(lambda: page.session.prepared_run is not None)
        assert page.session.prepared_run.plan.frame_number == 0
        page.loop.close()

    asyncio.run(asyncio.wait_for(drive(), 60))
    assert page.errors == []
