"""Sources of frames: folders, and arrays of a pipe that nobody vouches for."""

import io
import struct

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.tracking.sources import frame_files, piped_frames, street_sequence


@pytest.fixture(scope="module")
def frame():
    return next(street_sequence(seed=2, num_frames=1))


class Pipe(io.RawIOBase):
    """Bytes that come a few at a time and cannot be sought in."""

    def __init__(self, content):
        self._content = io.BytesIO(content)

    def readable(self):
        return True

    def readinto(self, buffer):
        return self._content.readinto(memoryview(buffer)[: min(len(buffer), 1000)])


def pipe_of(*arrays):
    file = io.BytesIO()
    for array in arrays:
        np.save(file, array)
    return io.BufferedReader(Pipe(file.getvalue()))


def test_a_folder_stands_for_its_frames_by_name(tmp_path, frame):
    for name in ("b", "a", "c"):
        write_frame(tmp_path / f"{name}.npz", frame)
    (tmp_path / "notes.txt").write_text("no frame")
    names = frame_files(["first.npz", str(tmp_path)])
    assert [name[-5:] for name in names] == ["t.npz", "a.npz", "b.npz", "c.npz"]


def test_an_empty_folder_is_named(tmp_path):
    with pytest.raises(InputError, match="holds no frame file"):
        frame_files([str(tmp_path)])


@pytest.mark.parametrize("order", ["C", "F"])
def test_the_arrays_of_a_pipe_are_the_frames(frame, order):
    signal = np.asarray(frame.received, order=order)
    frames = list(piped_frames(pipe_of(signal, 2.0 * signal), frame))
    assert [each.name for each in frames] == ["frame 0", "frame 1"]
    np.testing.assert_array_equal(frames[1].received, 2.0 * frame.received)
    assert frames[0].radar == frame.radar
    assert frames[0].truth is None


def test_a_pipe_ends_between_two_arrays(frame):
    assert list(piped_frames(pipe_of(), frame)) == []


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"hello, this is no array", "Frame 0 of the pipe cannot be read"),
        (b"\x93NUM", "Frame 0 of the pipe cannot be read"),
        (b"\x93NUMPY\x01\x00" + struct.pack("<H", 60_000) + b"{", "cannot be read"),
    ],
)
def test_what_is_no_array_is_named(frame, content, sentence):
    with pytest.raises(InputError, match=sentence):
        list(piped_frames(io.BytesIO(content), frame))


def test_an_array_that_breaks_off_is_named(frame):
    content = pipe_of(frame.received).read()
    with pytest.raises(InputError, match="Frame 0 of the pipe cannot be read"):
        list(piped_frames(io.BytesIO(content[:-8]), frame))


@pytest.mark.parametrize(
    ("array", "sentence"),
    [
        (
            np.zeros((3, 4), complex),
            r"has shape \(3, 4\) and type complex128; it must be \(32, 256",
        ),
        (np.full((32, 256), "x"), "type <U1"),
        (np.zeros((0, 256)), "has 0 elements"),
    ],
)
def test_an_array_of_another_kind_is_named(frame, array, sentence):
    with pytest.raises(InputError, match=sentence):
        list(piped_frames(pipe_of(array), frame))


def test_objects_of_a_pipe_are_never_unpickled(frame):
    file = io.BytesIO()
    np.save(file, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="type object"):
        list(piped_frames(io.BytesIO(file.getvalue()), frame))
