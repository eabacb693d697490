"""What a browser may send to the served dashboard, sent by a client that keeps to no bounds."""

import asyncio
import base64
import contextlib
import gzip
import os
import resource
import struct
import zlib

import pytest
from tornado.websocket import WebSocketClosedError
from vsep_app.server.message_guard import MAX_BUFFER, MAX_TEXT, Upload

from tests.app.raw_client import ask, change, connected, ended, receive, send
from vsep.errors import InputError

GIBIBYTE = 2**30


class Page:
    """A page that is open over a connection, and its models by their labels."""

    def __init__(self, connection, document):
        self.connection, self.models = connection, list(_models(document))

    def model(self, label):
        """The number of what holds the state of a component."""
        return next(m["id"] for m in self.models if m["attributes"].get("label") == label)

    def component(self, label):
        """The number of the component itself."""
        number = self.model(label)
        return next(
            m["id"]
            for m in self.models
            if isinstance(m["attributes"].get("data"), dict)
            and m["attributes"]["data"].get("id") == number
        )

    def named(self, name):
        """The number of the model of a name."""
        return next(m["id"] for m in self.models if m["attributes"].get("name") == name)

    def kind(self, name):
        return next(m["id"] for m in self.models if m["name"].startswith(name))

    async def set(self, model, name, value):
        return await send(self.connection, "PATCH-DOC", change(model, name, value))

    async def tell(self, model, data, *buffers, name="data_event"):
        """Send an event of a component with a map."""
        told = {"type": "map", "entries": [[key, value] for key, value in data.items()]}
        values = {"type": "map", "entries": [["model", {"id": model}], ["data", told]]}
        event = {"type": "event", "name": name, "values": values}
        sent = {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": event}
        return await send(self.connection, "PATCH-DOC", {"events": [sent]}, *buffers)


def _models(value):
    if isinstance(value, dict):
        if "id" in value and "attributes" in value:
            yield value
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from _models(each)


def visit(server, scene, path="/studies"):
    """Open a page and let a scene play on it."""

    async def play():
        token = (await asyncio.to_thread(ask, server.port, path)).token
        async with connected(server.port, token, f"{path.rstrip('/')}/ws") as connection:
            await receive(connection)
            kind, document = await send(connection, "PULL-DOC-REQ", {})
            assert kind == "PULL-DOC-REPLY"
            return await scene(Page(connection, document))

    return asyncio.run(play())


def newest_page(server):
    sessions = server.registry.open_sessions.values()
    return max(sessions, key=lambda session: session.since).page.current


def form_of(server):
    return newest_page(server).form


def test_every_kind_of_bound_is_kept_by_the_server(app_server):
    """Numbers, one or several of a list, texts, files, ends, and what is hidden."""

    async def scene(page):
        form = form_of(app_server)
        before = form.workers.value, form.study_name.value, form.methods.value, form.cutoff.value
        processes, folder = page.model("Processes"), page.model("Results folder")
        rows = page.model("Open rows (.jsonl)")
        for model, name, value in (
            (processes, "value", 24 * os.cpu_count()),
            (processes, "value", 0),
            (processes, "value", 1.5),
            (processes, "value", "24"),
            (processes, "value", True),
            (processes, "value", [1, 24]),
            (page.model("GOSPA cutoff [cells]"), "value", {"type": "number", "value": "nan"}),
            (page.model("GOSPA cutoff [cells]"), "value", {"type": "number", "value": "+inf"}),
            (page.model("GOSPA cutoff [cells]"), "value", 10**400),
            (page.model("Study"), "value", "fig-99"),
            (page.model("Study"), "value", ["fig-3"]),
            (page.model("Methods"), "value", ["joint", "other"]),
            (page.model("Object threshold [dB]"), "value", "9" * 5001),
            (page.model("Object threshold [dB]"), "value", {"type": "map", "entries": []}),
            (rows, "value", "text"),
            (page.component("Results folder"), "visible", True),
            (page.kind("panel.models.markup.HTML"), "text", "<b>"),
            (folder, "value", {"type": "bytes", "data": "AAAA"}),
        ):
            kind, told = await page.set(model, name, value)
            assert kind == "ERROR", (name, value)
            assert told["text"].endswith(".")
            assert told["traceback"] is None
            assert "\n" not in told["text"]
        after = form.workers.value, form.study_name.value, form.methods.value, form.cutoff.value
        assert after == before
        # What is offered stays as it is.
        for model, name, value in (
            (processes, "end", 24 * os.cpu_count()),
            (processes, "nothing", 1),
            (page.model("Study"), "options", ["fig-99"]),
            (page.model("Object threshold [dB]"), "max_length", 10**9),
            (rows, "max_file_size", 2**40),
        ):
            assert (await page.set(model, name, value))[0] == "OK"
        assert form.workers.end == os.cpu_count()
        assert "fig-99" not in form.study_name.options
        assert form.threshold.max_length == 5000
        assert form.upload.max_file_size is None

    visit(app_server, scene)


def test_what_is_offered_is_taken_unless_it_is_hidden_or_disabled(app_server, tmp_path):
    """Here nobody has the token, so nobody owns folders."""

    async def scene(page):
        form = form_of(app_server)
        for label, value in (
            ("Study", "fig-5"),
            ("Realizations per point", 7),
            ("GOSPA cutoff [cells]", 2),
            ("Object threshold [dB]", "9.5"),
            ("Methods", ["joint"]),
            ("Results folder", str(tmp_path / "theirs")),
        ):
            kind, told = await page.set(page.model(label), "value", value)
            assert kind == "OK", told
        chosen = form.realizations.value, form.cutoff.value, form.study_name.value
        assert chosen == (7, 2, "fig-5")
        assert form.path(tmp_path).parent == tmp_path
        # What is no longer offered may still be on its way.
        form.realizations.end = 10
        assert (await page.set(page.model("Realizations per point"), "value", 11))[0] == "OK"
        assert form.realizations.value == 7
        form.seed.disabled = True
        assert (await page.set(page.model("Seed"), "value", 5))[0] == "OK"
        assert form.seed.value == 1

    visit(app_server, scene)


def memory_mb():
    """The most memory that this process has ever had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def test_what_is_packed_in_a_message_is_not_unpacked(app_server):
    """1.4 MB of base64 are a gibibyte of zeros; Bokeh would unpack them wherever they stand."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    start = packer.compress(b"") + packer.flush(zlib.Z_FULL_FLUSH)
    part = packer.compress(bytes(2**24)) + packer.flush(zlib.Z_FULL_FLUSH)
    # A block that is flushed so can stand as often as one likes.
    bomb, half = (
        {"type": "bytes", "data": base64.b64encode(start + count * part).decode()}
        for count in (GIBIBYTE // 2**24, GIBIBYTE // 2**25)
    )
    assert len(half["data"]) < MAX_TEXT < len(bomb["data"]) < 1.5e6
    small = {"type": "bytes", "data": base64.b64encode(gzip.compress(bytes(1000))).decode()}
    inside = {
        "type": "ndarray",
        "array": small,
        "shape": [1000],
        "dtype": "uint8",
        "order": "little",
    }

    async def scene(page):
        before = memory_mb()
        model = page.model("Seed")
        for value in (half, [small], {"type": "map", "entries": [["x", inside]]}, inside):
            assert (await page.set(model, "value", value))[0] == "ERROR"
        assert (await page.tell(page.component("Seed"), {"x": half}))[0] == "ERROR"
        rows = page.component("Open rows (.jsonl)")
        told = {"status": "upload_event", "name": "a", "chunk": 1, "total_chunks": 1, "data": half}
        assert (await page.tell(rows, told))[0] == "ERROR"
        # Beside what is asked for, nothing is read: not in the message, an event, or a reference.
        for content in (
            {**change(model, "value", 2), "references": half},
            {"events": [{"more": half, **change(model, "value", 2)["events"][0]}]},
            {
                "events": [
                    {**change(model, "value", 2)["events"][0], "model": {**half, "id": model}}
                ]
            },
            {"events": [{**change("p0", "value", 2)["events"][0], "new": half}]},
            {"events": [{**change(model, "value", 2)["events"][0], "new": 2}] * 2},
        ):
            assert (await send(page.connection, "PATCH-DOC", content))[0] == "OK"
        with pytest.raises(ConnectionError):
            await page.set(model, "value", bomb)
        assert memory_mb() - before < 64.0

    visit(app_server, scene)


def test_frames_are_not_unpacked_either(app_server):
    """Compression is not agreed upon, so a frame that says it is compressed ends the connection."""
    squeezed = zlib.compressobj(9, zlib.DEFLATED, -15)
    frame = squeezed.compress(bytes(2**20)) + squeezed.flush(zlib.Z_SYNC_FLUSH)

    async def scene(page):
        stream = page.connection.protocol.stream
        header = bytes([0b1100_0001, 0x80 | 126]) + struct.pack(">H", len(frame)) + bytes(4)
        await stream.write(header + frame)
        await asyncio.wait_for(ended(page.connection), 20)

    visit(app_server, scene)


def test_sliders_end_menus_have_items_and_no_models_are_made(app_server):
    async def scene(page):
        slider = page.model("SNR [dB, total]")
        for name in ("value", "value_throttled"):
            assert (await page.set(slider, name, 1e9))[0] == "ERROR"
            assert (await page.set(slider, name, 41))[0] == "OK"
        for place in (9, -1, "0", [0, 0]):
            told = await page.tell(page.component("Snapshot"), {"type": "click", "item": place})
            assert "menu has no item" in told[1]["text"]
        code = {"type": "object", "name": "CustomJS", "id": "p1", "attributes": {"code": "x"}}
        assert (await page.set(page.model("Seed"), "value", code))[0] == "ERROR"
        assert (await page.set(page.kind("CustomJS"), "code", "x"))[0] == "ERROR"
        for event in (
            {"kind": "RootAdded", "model": code},
            {"kind": "TitleChanged", "title": "x"},
            {"kind": "MessageSent", "msg_type": "other", "msg_data": 1},
            {"kind": "ModelChanged"},
            "no event",
        ):
            assert (await send(page.connection, "PATCH-DOC", {"events": [event]}))[0] == "ERROR"
        for kind in ("PUSH-DOC", "PULL-DOC-REQ"):
            assert (await send(page.connection, kind, {}))[0] == "ERROR"

    visit(app_server, scene, "/")


def test_a_slider_over_some_values_offers_these_only(app_server):
    async def scene(page):
        alarms = page.model("False alarms a frame")
        assert (await page.set(alarms, "value", 99))[0] == "ERROR"
        assert (await page.set(alarms, "value", 1))[0] == "OK"

    visit(app_server, scene, "/compare")


def test_a_browser_says_what_is_pressed_and_dragged_and_writes_no_figure(app_server):
    """Sources of that name only, with their columns, one short word or number each."""

    def columns(**values):
        return {"type": "map", "entries": [[key, [value]] for key, value in values.items()]}

    async def scene(page):
        live = newest_page(app_server)
        pressed, dragged = (page.named(name) for name in ("pressed", "dragged"))
        drag = {"x": 1.0, "y": 0.0, "dx": 0.01, "dy": 0.01, "number": 1}
        for model, data in (
            (pressed, columns(name="x" * 101, number=1)),
            (pressed, columns(name="reset")),
            (pressed, {"type": "map", "entries": [["name", ["a", "b"]], ["number", [1, 2]]]}),
            (dragged, columns(phase=0, **drag, more=1)),
            (live.views.fast_time.source.id, columns(axis=1.0)),
        ):
            assert (await page.set(model, "data", data))[0] == "ERROR"
        for model, data in (
            (pressed, columns(name="format the disk", number=1)),
            (dragged, columns(phase=9, **drag)),
            (dragged, columns(phase="0", **drag)),
            (dragged, columns(phase=0, **{**drag, "x": {"type": "number", "value": "nan"}})),
        ):
            assert (await page.set(model, "data", data))[0] == "OK"
        assert live.chirps._grip is None

    visit(app_server, scene, "/")


NO_MESSAGES = (
    ["x" * (MAX_TEXT + 1)],
    ['{"msgid": "1", "msgtype": "PATCH-DOC", "num_buffers": 9}', "{}", "[" * 100_000],
    ["nothing"] * 3,
    ['{"msgid": "1", "msgtype": "OTHER"}', "{}", "{}"],
    [b"bytes"],
    ['{"msgid": "1", "msgtype": "PATCH-DOC", "num_buffers": 9}', "{}", '{"events": []}']
    + ['{"id": "0"}', bytes(MAX_BUFFER // 2)] * 3,
)


def test_what_is_no_message_or_too_large_ends_the_connection(app_server, caplog):
    token = ask(app_server.port, "/studies").token

    async def scene():
        for parts in NO_MESSAGES:
            async with connected(app_server.port, token) as connection:
                await receive(connection)
                # The server does not wait for the last part of what is too large.
                with contextlib.suppress(WebSocketClosedError):
                    for part in parts:
                        await connection.write_message(part, binary=isinstance(part, bytes))
                await asyncio.wait_for(ended(connection), 20)

    asyncio.run(scene())
    assert [record for record in caplog.records if record.exc_info] == []


def test_files_come_in_parts_up_to_their_largest_size(app_server):
    async def scene(page):
        field = page.component("Open rows (.jsonl)")
        status = {"status": "upload_event", "name": "a.jsonl", "mime_type": "", "type": "status"}
        content = {"data": {"type": "bytes", "data": {"id": "0"}}}
        for part, kind in ((2, "ERROR"), (1, "OK"), (3, "ERROR"), (2, "OK")):
            told = {**status, "chunk": part, "total_chunks": 10**9, **content}
            assert (await page.tell(field, told, b"{}"))[0] == kind

    visit(app_server, scene)


def test_an_upload_is_counted_until_the_field_has_taken_it():
    upload = Upload(100)

    def part(number, of, num_bytes, name="a"):
        told = {"status": "upload_event", "name": name, "chunk": number, "total_chunks": of}
        upload.take(told, num_bytes)

    part(1, 2, 60)
    upload.take({"status": "finished"}, 0)
    with pytest.raises(InputError, match="more than"):
        part(2, 2, 60)
    upload = Upload(100)
    for name in "abc":
        part(1, 1, 90, name)
        upload.take({"status": "finished"}, 0)
    part(1, 2, 60)  # is left, and stays
    part(1, 1, 30, "b")
    upload.take({"status": "finished"}, 0)
    with pytest.raises(InputError, match="more than"):
        part(1, 1, 41, "b")
    with pytest.raises(InputError, match="one after the other"):
        part(3, 3, 1, "c")
