import asyncio
import base64
from concurrent.futures import ThreadPoolExecutor

import pytest
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.report.snapshot import SnapshotFile
from vsep_app.widgets.share import MAX_FILE, Share

from vsep.errors import InputError


@pytest.fixture
def errors():
    """What the user was told."""
    return []


def click(make, errors):
    """Click on the first item of the menu and wait for the file."""

    async def run():
        with ThreadPoolExecutor(1) as pool:
            background = BackgroundTasks()
            share = Share(
                {"html": make}.get,
                pool=pool,
                post=lambda act: act(),
                notify_error=errors.append,
                background=background,
            )
            share._chosen({"label": "a page", "key": "html"})
            assert share.snapshot.loading is (make is not None)
            while background.num_running:
                await asyncio.sleep(0.001)
            assert not share.snapshot.loading
            return share.download.source.data

    return asyncio.run(run())


def test_a_file_goes_to_the_browser(errors):
    made = SnapshotFile(name="a.html", kind="text/html", content=b"\x00page")
    data = click(lambda: made, errors)
    assert (data["name"], data["kind"]) == (["a.html"], ["text/html"])
    assert base64.b64decode(data["data"][0]) == b"\x00page"
    assert errors == []


def test_what_cannot_be_made_is_told(errors):
    def fail():
        raise InputError("No frame.")

    assert click(fail, errors)["name"] == [""]
    click(None, errors)
    large = SnapshotFile(name="a.npz", kind="x", content=bytes(MAX_FILE + 1))
    assert click(lambda: large, errors)["name"] == [""]
    assert [sentence.split(";")[0] for sentence in errors] == [
        "No frame.",
        "There is no run yet",
        "a.npz is too large for the browser",
    ]
