import asyncio
import base64
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.report.snapshot import SnapshotFile
from app.share import LARGEST_FILE, Share
from vsep._arrays import InputError


@pytest.fixture
def complaints():
    """What the user was told."""
    return []


def click(make, complaints):
    """Click on the first item of the menu and wait for the file."""

    async def run():
        with ThreadPoolExecutor(1) as pool:
            share = Share(
                {"html": make}.get, pool=pool, post=lambda act: act(), complain=complaints.append
            )
            share._chosen({"label": "a page", "key": "html"})
            assert share.snapshot.loading is (make is not None)
            while share._tasks:
                await asyncio.gather(*share._tasks)
            assert not share.snapshot.loading
            return share.download.source.data

    return asyncio.run(run())


def test_a_file_goes_to_the_browser(complaints):
    made = SnapshotFile(name="a.html", kind="text/html", content=b"\x00page")
    data = click(lambda: made, complaints)
    assert (data["name"], data["kind"]) == (["a.html"], ["text/html"])
    assert base64.b64decode(data["data"][0]) == b"\x00page"
    assert complaints == []


def test_what_cannot_be_made_is_told(complaints):
    def fail():
        raise InputError("No frame.")

    assert click(fail, complaints)["name"] == [""]
    click(None, complaints)
    large = SnapshotFile(name="a.npz", kind="x", content=bytes(LARGEST_FILE + 1))
    assert click(lambda: large, complaints)["name"] == [""]
    assert [sentence.split(";")[0] for sentence in complaints] == [
        "No frame.",
        "There is no run yet",
        "a.npz is too large for the browser",
    ]
