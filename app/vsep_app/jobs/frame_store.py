"""Frames that one page hands to another: kept by the server for a while, named by a link."""

import secrets
import tempfile
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vsep.files.frame import Frame, write_frame
from vsep_app.report.spec import KeptFrame

FRAME_KEY = "frame"
MAX_BYTES = 128_000_000


@dataclass(frozen=True, kw_only=True)
class StoredFrame:
    """A frame file and the word that names it."""

    word: str
    frame: KeptFrame


class FrameStore:
    """The frame files that have been handed over; the oldest are forgotten.

    Parameters
    ----------
    most_bytes : int
        Memory of all of them.

    Examples
    --------
    >>> frames = FrameStore()
    >>> frames.find(frames.keep(KeptFrame(name="own.npz", content=b"..."))).name
    'own.npz'
    """

    def __init__(self, most_bytes: int = MAX_BYTES) -> None:
        self._most = most_bytes
        self._frames: OrderedDict[str, KeptFrame] = OrderedDict()

    def keep(self, frame: KeptFrame) -> str:
        """Take a frame file and return the word that names it; nobody can guess it."""
        word = secrets.token_urlsafe(12)
        self._frames[word] = frame
        while len(self._frames) > 1 and self._num_bytes > self._most:
            self._frames.popitem(last=False)
        return word

    def find(self, word: str) -> KeptFrame | None:
        """Return the frame file of a word, None if there is none any more."""
        return self._frames.get(word)

    @property
    def _num_bytes(self) -> int:
        return sum(len(frame.content) for frame in self._frames.values())


def frame_bytes(frame: Frame) -> bytes:
    """Return the frame file of a frame."""
    with tempfile.TemporaryDirectory(prefix="vsep-") as folder:
        path = Path(folder) / "frame.npz"
        write_frame(path, frame)
        return path.read_bytes()


def frame_of_query(
    query: Mapping[str, Any], frames: FrameStore
) -> tuple[StoredFrame | None, dict[str, Any], list[str]]:
    """Return the frame that an address names, the rest of its query, and what is wrong with it."""
    rest = {key: value for key, value in query.items() if key != FRAME_KEY}
    if FRAME_KEY not in query:
        return None, rest, []
    # The live view writes the loaded frame into its address; here the link brings it.
    rest.pop("preset", None)
    word = str(query[FRAME_KEY])
    frame = frames.find(word)
    if frame is None:
        return None, rest, ["The frame of this link is no longer kept; open it again."]
    return StoredFrame(word=word, frame=frame), rest, []
