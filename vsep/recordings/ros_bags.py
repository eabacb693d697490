"""Words of raw captures in ROS bags: ``.bag`` of ROS 1, folders of ROS 2.

Whatever the type of its messages is, the longest array of numbers in each message of a topic holds
words as the capture card sent them; a message after the other they are a raw capture.
"""

from collections import Counter
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._optional import require_library
from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES
from vsep.files.opening import open_regular

SUFFIX: Final = ".bag"
_BEGINNING: Final = b"#ROSBAG V2.0"
_DEEPEST = 4  # messages in messages
_MOST_BYTES = 4 * MAX_SAMPLES
_MOST_MESSAGES = 2**20
_WORDS = (1, 2)  # bytes of an element


def is_bag(path: str) -> bool:
    """Whether a path is a bag, by its name and its first bytes or the files in the folder."""
    place = Path(path)
    if place.is_dir():
        return (place / "metadata.yaml").is_file()
    if place.suffix.lower() != SUFFIX or not place.is_file():
        return False
    with open_regular(path, path, "a recording") as file:
        return file.read(len(_BEGINNING)) == _BEGINNING


def read_bag(path: str, topic: str | None) -> tuple[NDArray[np.uint8], str]:
    """Return the bytes of a capture and a remark on the topic.

    Parameters
    ----------
    path : str
        A bag.
    topic : str or None
        That of the messages; None where only one topic has arrays of words.

    Raises
    ------
    InputError
        If the library rosbags is missing, no or several topics hold words, or the bag is damaged.
    """
    anyreader = require_library("rosbags.highlevel", f"{path} is a ROS bag; it", "ros")
    parts: list[NDArray[Any]] = []
    try:
        with anyreader.AnyReader([Path(path)]) as reader:
            chosen = _connections(path, reader, topic)
            left = _MOST_BYTES
            for connection, _, content in reader.messages(connections=chosen):
                left -= len(content)
                if left < 0 or len(parts) >= _MOST_MESSAGES:
                    raise InputError(
                        f"{path} holds more than {_MOST_BYTES} bytes in its topic; a part of it is "
                        "needed."
                    )
                found = _longest(reader.deserialize(content, connection.msgtype))
                if found is not None:
                    parts.append(np.ascontiguousarray(found).view(np.uint8))
    except InputError:
        raise
    # Whatever the library runs into; it names many kinds of errors.
    except Exception as error:
        raise InputError(f"{path} is damaged or no ROS bag; record it again.") from error
    if not parts:
        raise InputError(f"{path} holds no words in {chosen[0].topic}; say key: the topic.")
    lengths = Counter(part.size for part in parts)
    remark = f"{path}: {len(parts)} messages of {chosen[0].topic} are taken for a raw capture"
    if len(lengths) > 1:
        remark += f"; their lengths differ ({', '.join(map(str, sorted(lengths)[:4]))} bytes)"
    return np.concatenate(parts), f"{remark}."


def _connections(path: str, reader: Any, topic: str | None) -> list[Any]:
    """Return the connections of the topic, or of the one whose first message holds most words."""
    topics = sorted({each.topic for each in reader.connections})
    if topic is not None:
        chosen = [each for each in reader.connections if each.topic == topic]
        if not chosen:
            raise InputError(
                f"{path} has no topic {topic[:60]!r}; it has {', '.join(topics[:12]) or 'none'}."
            )
        return chosen
    sizes = dict.fromkeys(topics, 0)
    for connection in reader.connections:
        first = next(iter(reader.messages(connections=[connection])), None)
        if first is not None:
            found = _longest(reader.deserialize(first[2], connection.msgtype))
            size = 0 if found is None else found.nbytes
            sizes[connection.topic] = max(sizes[connection.topic], size)
    best = max(sizes, key=lambda name: sizes[name], default=None)
    if best is None or sizes[best] == 0:
        raise InputError(
            f"{path} has no topic with arrays of words; it has {', '.join(topics[:12]) or 'none'}."
        )
    return [each for each in reader.connections if each.topic == best]


def _longest(message: Any, depth: int = 0) -> NDArray[Any] | None:
    """Return the longest array of words in a message or the messages in it."""
    best: NDArray[Any] | None = None
    for value in vars(message).values() if hasattr(message, "__dict__") else ():
        found = None
        if isinstance(value, np.ndarray):
            if value.dtype.kind in "iu" and value.dtype.itemsize in _WORDS:
                found = value
        elif depth < _DEEPEST and not isinstance(value, str | bytes | list):
            found = _longest(value, depth + 1)
        if found is not None and (best is None or found.nbytes > best.nbytes):
            best = found
    return best
