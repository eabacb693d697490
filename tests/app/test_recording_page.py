"""The page of recorded data without a browser: files, settings, controls, and what is told."""

import asyncio
import io
import tempfile
import time
import urllib.request
from pathlib import Path

import numpy as np
from vsep_app.jobs import run_loop as loop
from vsep_app.jobs.background import BackgroundTasks
from vsep_app.jobs.frame_store import FRAME_KEY
from vsep_app.jobs.pool import WorkerPool
from vsep_app.jobs.run_session import Phase
from vsep_app.jobs.worker import Limited
from vsep_app.pages.base import PageContext
from vsep_app.pages.recording import tasks
from vsep_app.pages.recording.page import EXAMPLE, RecordingPage

from tests.app.conftest import until
from tests.vsep.layout_scenes import LAYOUT_SETTINGS, LAYOUTS, capture
from vsep.files.frame import read_frame


class Driven:
    """A page whose sentences are kept, and a raw capture to drop on it."""

    def __init__(self, page, told, capture):
        self.page, self.told, self.capture = page, told, capture

    async def shown(self, name):
        """Wait until the recording of a name is shown."""
        await until(lambda: self.page._prepared_run is not None)
        await until(lambda: self.page._prepared_run.plan.file.name == name)

    async def opened(self):
        """Drop the capture with its settings and wait until it is shown."""
        self.page.drop([("a.bin", self.capture.content), ("a.yaml", self.capture.settings)])
        await self.shown("a.bin")

    async def told_of(self, words):
        await until(lambda: any(words in sentence for sentence in self.told))


def on_a_page(work):
    """A test of a coroutine function that gets a started page that shows the example."""

    def test(pool, monkeypatch, raw_capture):
        told = []
        # No browser says that it has drawn a picture.
        monkeypatch.setattr(loop, "MAX_FLIGHT_S", 0.01)
        monkeypatch.setattr(RecordingPage, "notify_error", lambda _, words: told.append(words))
        context = PageContext(
            pool=pool, query={}, post=lambda function: function(), watched=lambda: True
        )
        driven = Driven(RecordingPage(context), told, raw_capture)

        async def session():
            driven.page.page()
            driven.page.start()
            await driven.shown(EXAMPLE)
            await work(driven)
            driven.page.close()

        asyncio.run(session())

    return test


@on_a_page
async def test_the_example_is_shown_but_not_run(driven):
    page = driven.page
    assert page.session.phase is Phase.IDLE
    assert page._prepared_run.plan.is_frame
    assert not page.form.live.disabled
    assert "128 ramps of 128 samples" in page.view.facts.object
    assert page.settings.ramp == page._prepared_run.loudest_ramp


@on_a_page
async def test_capture_and_settings_dropped_together_run_to_the_end(driven):
    page = driven.page
    page.drop([("radar.yaml", driven.capture.settings), ("adc.bin", driven.capture.content)])
    await driven.shown("adc.bin")
    assert page.form.quick["sign"].value == "negative"
    page.settings.speed = 30
    page.session.run()
    page.loop.wake()
    await until(lambda: page.session.phase is Phase.FINISHED)
    await until(lambda: page.view.tables.picture.iteration == page.session.num_steps)
    assert len(page.view.tables.shown("table")) >= 1
    assert any(line.kind.startswith("burst") for line in page.view.tables.shown("log"))
    assert driven.told == []


@on_a_page
async def test_controls_and_text_are_the_same_settings(driven):
    page = driven.page
    page.drop([("adc.bin", driven.capture.content)])
    await until(lambda: "start_frequency_hz is not given" in page.view.facts.object)
    assert page.form.text.error_state
    assert driven.told == []
    # The settings may come later; a remark of their author stays.
    page.drop([("radar.yml", driven.capture.settings)])
    await driven.shown("adc.bin")
    page.form.text.value += "# as printed\n"
    page.form.quick["sign"].value = "positive"
    page.form.quick["crop_start_samples"].value = 8
    await until(lambda: page._prepared_run.plan.settings.crop_start_samples == 8)
    assert page.form.text.value.endswith("# as printed\ncrop_start_samples: 8\n")
    assert "sign: positive\n" in page.form.text.value
    assert "is perhaps the other one" in page.view.facts.object
    page.form.text.value = page.form.text.value.replace("positive", "negative")
    await until(lambda: page._prepared_run.plan.settings.sign == "negative")
    assert page.form.quick["sign"].value == "negative"


@on_a_page
async def test_controls_say_which_side_of_the_band_and_which_receivers(driven):
    page = driven.page
    await driven.opened()
    quick = page.form.quick
    quick["samples"].value = "complex-1x"
    await until(lambda: page._prepared_run.prepared.static_picture.radar.lowest_beat == 0.0)
    assert "samples: complex-1x\n" in page.form.text.value
    quick["lowest_beat"].value = -0.25
    await until(lambda: page._prepared_run.prepared.static_picture.radar.lowest_beat == -0.25)
    quick["lowest_beat"].value = None
    await until(lambda: page._prepared_run.prepared.static_picture.radar.lowest_beat == 0.0)
    quick["antennas"].value = "0"
    quick["offset"].value = "remove"
    await until(lambda: page._prepared_run.plan.settings.offset == "remove")
    assert page._prepared_run.plan.settings.antennas == "0"
    page.form.text.value = page.form.text.value.replace("offset: remove", "offset: keep")
    assert quick["offset"].value == "keep"
    assert driven.told == []


@on_a_page
async def test_a_configuration_of_the_sensor_is_dropped_with_its_capture(driven):
    page = driven.page
    ramps, samples = driven.capture.received.shape[-2:]
    text = (
        "channelCfg 1 1 0\nadcCfg 2 2\n"
        f"profileCfg 0 79 7 6 200 0 0 10 0 {samples} 10000 0 0 30\n"
        f"chirpCfg 0 0 0 0 0 0 0 1\nframeCfg 0 0 {ramps} 1 100 1 0\n"
    )
    page.drop([("radar.cfg", text.encode()), ("adc.bin", driven.capture.content)])
    await driven.shown("adc.bin")
    settings = page._prepared_run.plan.settings
    assert settings.slope_hz_per_s == 10e12
    assert settings.samples == "complex-2x"
    assert settings.num_ramps == ramps
    assert driven.told == []


@on_a_page
async def test_a_second_capture_of_the_sensor_needs_no_settings(driven):
    page = driven.page
    await driven.opened()
    first = Path(page._file.path)
    page.drop([("b.bin", driven.capture.content)])
    await driven.shown("b.bin")
    assert not first.exists()
    # As an array it has another format, and everything else is as it was.
    file = io.BytesIO()
    np.save(file, driven.capture.received)
    page.drop([("c.npy", file.getvalue())])
    await driven.shown("c.npy")
    assert page._prepared_run.plan.settings.format == "npy"
    assert driven.told == []


@on_a_page
async def test_what_cannot_be_is_told_and_the_last_good_stays(driven):
    page = driven.page
    await driven.opened()
    for name, content, words in (
        ("bad.npz", b"no archive", "bad.npz is not a frame file"),
        ("bad.mat", b"no file", "bad.mat is no MATLAB file"),
        ("empty.bin", b"", "empty.bin is empty"),
        ("bad.json", b"{", "bad.json is no JSON"),
        ("bad.yaml", b"\xff\xfe\xff", "bad.yaml is no text"),
    ):
        page.drop([(name, content)])
        await driven.told_of(words)
    page.drop([("a.bin", b"12"), ("b.bin", b"12")])
    assert "2 files were dropped" in driven.told[-1]
    page.drop_response([("response.npz", b"no archive")])
    await driven.told_of("response.npz is not")
    assert Path(page._file.path).read_bytes() == driven.capture.content
    page.form.text.value += "slope: 3\n"
    assert driven.told[-1].startswith("'slope' is no setting; did you mean ")
    assert "did you mean" in page.view.facts.object
    assert "a.bin" in page.view.facts.object
    page.drop([("radar.yaml", driven.capture.text(num_samples="100"))])
    await driven.told_of("no whole number of ramps")
    assert page.form.live.disabled
    page.drop([("radar.yaml", driven.capture.settings)])
    await until(lambda: page._prepared_run is not None)
    assert not page.form.live.disabled
    assert not page.form.text.error_state


@on_a_page
async def test_a_clean_recording_is_shown_beside_until_it_does_not_fit(driven):
    page = driven.page
    page.drop([("a.bin", driven.capture.content), ("a.yaml", driven.capture.settings)])
    await driven.shown("a.bin")
    page.drop_reference([("clean.bin", driven.capture.content)])
    await until(lambda: page._prepared_run and page._prepared_run.reference_maps)
    assert page.view._reference.visible
    page.drop_reference([("short.bin", driven.capture.content[: len(driven.capture.content) // 2])])
    await driven.told_of("short.bin has 8 ramps")
    assert page._reference is None
    page.form.clutter.value = True
    await until(lambda: page._prepared_run.plan.removes_clutter)
    assert not page.view._reference.visible


@on_a_page
async def test_the_frame_is_stored_to_the_live_view_and_saved(driven):
    page = driven.page
    await driven.opened()
    page.form.live.clicks += 1
    await until(lambda: page._link.source.data["place"][0])
    start, word = page._link.source.data["place"][0].split(f"{FRAME_KEY}=")
    assert start == "./?"
    stored = page._context.shared_resources.frames.find(word)
    frame = read_frame(io.BytesIO(stored.content), name=stored.name)
    assert (frame.name, frame.beat_sign, frame.radar.shape) == ("a-frame.npz", -1, (16, 128))
    page.form.save.clicks += 1
    await until(lambda: page._download.source.data["name"] == ["a-frame.npz"])
    assert driven.told == []


def _read_for_long(file):
    del file
    while True:
        pass


def test_a_file_that_takes_long_to_read_is_given_up_and_nobody_waits_for_it(
    app_server, raw_capture, monkeypatch
):
    slow = Limited(function=_read_for_long, what="The file", seconds=1.5, megabytes=64)
    monkeypatch.setattr(tasks, "FILE_FACTS", slow)
    told, times = [], []
    monkeypatch.setattr(RecordingPage, "notify_error", lambda _, words: told.append(words))
    workers = WorkerPool((), workers=1)
    loop = app_server.io_loop.asyncio_loop
    context = PageContext(
        pool=workers.queue(),
        query={},
        post=loop.call_soon_threadsafe,
        watched=lambda: False,
        background=BackgroundTasks(loop),
    )
    page = RecordingPage(context)
    loop.call_soon_threadsafe(page.drop, [("adc.bin", raw_capture.content)])
    deadline = time.monotonic() + 60.0
    while not told and time.monotonic() < deadline:
        begun = time.monotonic()
        with urllib.request.urlopen(f"http://127.0.0.1:{app_server.port}/health") as answer:
            answer.read()
        times.append(time.monotonic() - begun)
        time.sleep(0.05)
    page.close()
    workers.close()
    assert told == ["The file takes more than 1.5 s; give a smaller one."]
    assert len(times) > 5
    assert max(times) < 0.5


@on_a_page
async def test_a_capture_without_settings_shows_three_layouts_and_a_click_chooses(driven):
    page = driven.page
    layout = LAYOUTS[2]
    page.drop([("adc.bin", capture(layout, "clutter", np.random.default_rng(3)))])
    await until(lambda: page.form.guesses.panel.visible)
    # The best one is taken at once; what the radar was is still asked for.
    assert tuple(page.form.values()[name] for name in LAYOUT_SETTINGS) == layout.settings
    assert "start_frequency_hz is not given" in page.view.facts.object
    second = page.form.guesses.buttons[1]
    assert second.label.startswith("2 · ")
    assert "of the cells" in second.description
    second.clicks += 1
    assert f"{page.form.values()['num_samples']} samples" in second.label
    assert page.form.values()["num_samples"] != layout.num_samples or (
        page.form.values()["format"] != layout.format
    )
    # Settings that name the layout are not doubted.
    page.drop([("b.bin", driven.capture.content), ("b.yaml", driven.capture.settings)])
    await driven.shown("b.bin")
    assert not page.form.guesses.panel.visible


@on_a_page
async def test_captures_of_a_folder_are_shown_judged_and_kept_as_a_clip(driven):
    page = driven.page
    with tempfile.TemporaryDirectory() as folder:
        page.folder.folder.value = folder
        page.folder.follow.value = True
        await until(lambda: page._context.background.num_running > 0)
        await asyncio.sleep(0.1)
        # Of the example's settings nothing follows for a capture.
        (Path(folder) / "first.bin").write_bytes(driven.capture.content)
        await until(lambda: "Drop the configuration" in page.folder.list.object)
        page.drop([("radar.yaml", driven.capture.settings)])
        # The example is no raw capture, so that nothing is shown until one comes.
        await until(lambda: page._prepared_run is None)
        (Path(folder) / "second.bin").write_bytes(driven.capture.content)
        await driven.shown("second.bin")
        await until(lambda: "<strong>second.bin" in page.folder.list.object)
        assert "Yes, with separation" in page.folder.list.object
        page.folder.save.clicks += 1
        await until(lambda: "2 captures are kept" in page.folder.list.object)
        kept = Path(folder) / "clips" / "second"
        assert sorted(path.name for path in kept.iterdir()) == ["first.bin", "second.bin"]
        page.folder.follow.value = False
        page.folder.folder.value = str(Path(folder) / "nowhere")
        page.folder.follow.value = True
        await driven.told_of("cannot be watched")
        assert not page.folder.follow.value
