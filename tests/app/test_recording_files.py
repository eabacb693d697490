"""Files that a visitor dropped."""

from pathlib import Path

import pytest
from vsep_app.pages.recording import files
from vsep_app.pages.recording.files import DroppedFiles, DropZone
from vsep_app.pages.recording.stored_file import StoredFile

from vsep.errors import InputError


def test_files_stay_in_their_folder_and_go_with_the_page():
    dropped = DroppedFiles()
    file = dropped.keep("../../etc/adc.NPZ", b"abc")
    path = Path(file.path)
    assert file.name == "../../etc/adc.NPZ"
    assert (path.name, path.read_bytes()) == ("1.npz", b"abc")
    other = dropped.keep("adc", b"d")
    assert Path(other.path).parent == path.parent
    dropped.discard(file)
    assert not path.exists()
    dropped.close()
    assert not path.parent.exists()


def test_no_file_of_somebody_else_is_removed(tmp_path):
    own = tmp_path / "own.npz"
    own.write_bytes(b"kept")
    dropped = DroppedFiles()
    dropped.discard(StoredFile(path=str(own), name="own.npz"))
    dropped.keep("a.npy", b"1")
    dropped.discard(StoredFile(path=str(own), name="own.npz"))
    dropped.close()
    assert own.read_bytes() == b"kept"


def test_sizes_have_limits(monkeypatch):
    monkeypatch.setattr(files, "MAX_FILE", 2 * 2**20)
    dropped = DroppedFiles()
    with pytest.raises(InputError, match=r"adc.bin has 3 MB; at most 2 MB are taken"):
        dropped.keep("adc.bin", bytes(3 * 2**20))
    with pytest.raises(InputError, match=r"adc.bin is empty"):
        dropped.keep("adc.bin", b"")


def _chunk(name, data):
    values = {"status": "upload_event", "name": name, "data": data, "mime_type": ""}
    return {**values, "chunk": 1, "total_chunks": 1}


def test_what_the_browser_sends_is_stored_on_once_and_may_come_again():
    taken, told = [], []
    zone = DropZone(take=taken.append, notify_error=told.append, label="Files")
    for _ in range(2):
        zone._handle_msg(_chunk("a.npy", b"abc"))
        zone._handle_msg(_chunk("a.yaml", b"x: 1"))
        zone._handle_msg({"status": "finished"})
    assert taken == [[("a.npy", b"abc"), ("a.yaml", b"x: 1")]] * 2
    assert (zone.value, told) == (None, [])


def test_what_the_browser_cannot_send_is_a_sentence():
    taken, told = [], []
    zone = DropZone(take=taken.append, notify_error=told.append, label="Files")
    zone._handle_msg({"status": "error", "error": "File size exceeds ..."})
    zone._handle_msg({"status": "finished"})
    assert told == [
        "The browser did not send the file; at most 256 MB are taken.",
        "The file is empty; a recording is needed.",
    ]
    assert taken == []


def test_more_than_the_largest_file_is_dropped_as_it_arrives(monkeypatch):
    monkeypatch.setattr(files, "_MOST_AT_ONCE", 10)
    taken, told = [], []
    zone = DropZone(take=taken.append, notify_error=told.append, label="Files")
    for number in range(4):
        zone._handle_msg(_chunk(f"{number}.npy", b"four"))
        assert len(zone._buffer) <= 2
    assert (zone._buffer, told) == ([], [])
    zone._handle_msg({"status": "finished"})
    assert (len(told), taken) == (1, [])
    zone._handle_msg(_chunk("a.npy", b"abc"))
    zone._handle_msg({"status": "finished"})
    assert taken == [[("a.npy", b"abc")]]
