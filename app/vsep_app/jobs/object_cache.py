"""Records that go back and forth between two processes, each of them sent once.

A run's frame, its estimator and its steps are needed with every job, but do not change. Each end of
a pipe has a `ObjectCache` that numbers such records; what the other end has already is sent as its
number, and what comes back as a number is the very object that was sent. The server's end holds
records weakly: once nobody there has a use for one, the other end is told to drop it.
"""

import io
import pickle
import weakref
from collections import deque
from functools import partial
from typing import Any

_PROTOCOL = 5


class ObjectCache:
    """One end of a pipe.

    Parameters
    ----------
    kept : tuple of type
        Classes whose instances never change and are sent once; they take weak references.
    serving : bool
        Whether this is the end that decides what is kept.

    Examples
    --------
    >>> from collections import OrderedDict
    >>> kept = (OrderedDict,)
    >>> here, there = ObjectCache(kept, serving=True), ObjectCache(kept, serving=False)
    >>> record = OrderedDict(iteration=1)
    >>> copy = there.unpack(here.pack(record))
    >>> here.unpack(there.pack(copy)) is record
    True
    """

    def __init__(self, kept: tuple[type, ...], *, serving: bool) -> None:
        self._kept, self._serving = kept, serving
        # Even numbers are given by the server's end, odd ones by the other.
        self._next = 0 if serving else 1
        self._numbers: dict[int, int] = {}
        self._records: dict[int, Any] = {}
        self._dead: deque[int] = deque()

    def __len__(self) -> int:
        """Return how many records both ends have."""
        return len(self._records)

    def pack(self, value: Any) -> bytes:
        """Return a value as bytes for the other end."""
        fresh: dict[int, _Fresh] = {}
        body = self._dump(value, fresh, root=None)
        parts = []
        for one in fresh.values():
            self._hold(one.number, one.record)
            parts.append((one.number, one.content))
        return pickle.dumps((self._forgotten(), parts, body), _PROTOCOL)

    def unpack(self, data: bytes) -> Any:
        """Return the value that the other end has packed."""
        forgotten, parts, body = pickle.loads(data)
        for number in forgotten:
            self._numbers.pop(id(self._records.pop(number, None)), None)
        # Nothing else holds them until the whole is there.
        arrived = []
        for number, content in parts:
            record = self._load(content)
            self._hold(number, record)
            arrived.append(record)
        return self._load(body)

    def number_of(self, record: Any, fresh: "dict[int, _Fresh]") -> int:
        """Return the number of a record; a new one joins those that are to be sent."""
        number = self._numbers.get(id(record))
        if number is not None:
            return number
        if id(record) not in fresh:
            content = self._dump(record, fresh, root=record)
            fresh[id(record)] = _Fresh(self._next, record, content)
            self._next += 2
        return fresh[id(record)].number

    def find(self, number: int) -> Any:
        """Return the record of a number."""
        held = self._records[number]
        return held() if self._serving else held

    @property
    def kept(self) -> tuple[type, ...]:
        """Classes that are sent once."""
        return self._kept

    def _dump(self, value: Any, fresh: "dict[int, _Fresh]", root: Any) -> bytes:
        buffer = io.BytesIO()
        _Packer(buffer, self, fresh, root).dump(value)
        return buffer.getvalue()

    def _load(self, content: bytes) -> Any:
        return _Unpacker(io.BytesIO(content), self).load()

    def _hold(self, number: int, record: Any) -> None:
        self._numbers[id(record)] = number
        if self._serving:
            died = partial(self._died, number, id(record))
            self._records[number] = weakref.ref(record, died)
        else:
            self._records[number] = record

    def _died(self, number: int, identity: int, _: Any) -> None:
        """Let go of a record before its place in memory can be another's; on whatever thread."""
        self._numbers.pop(identity, None)
        self._records.pop(number, None)
        self._dead.append(number)

    def _forgotten(self) -> list[int]:
        numbers = []
        while self._dead:
            numbers.append(self._dead.popleft())
        return numbers


class _Fresh:
    """A record that the other end does not have yet."""

    def __init__(self, number: int, record: Any, content: bytes) -> None:
        self.number, self.record, self.content = number, record, content


class _Packer(pickle.Pickler):
    """Writes kept records as their numbers, all but the one it is about."""

    def __init__(
        self, buffer: io.BytesIO, object_cache: ObjectCache, fresh: dict[int, _Fresh], root: Any
    ) -> None:
        super().__init__(buffer, _PROTOCOL)
        self._object_cache, self._fresh, self._root = object_cache, fresh, root

    def persistent_id(self, obj: Any) -> int | None:
        """Return the number of a kept record, None for everything else."""
        if obj is self._root or not isinstance(obj, self._object_cache.kept):
            return None
        return self._object_cache.number_of(obj, self._fresh)


class _Unpacker(pickle.Unpickler):
    """Puts the record in the place of its number."""

    def __init__(self, buffer: io.BytesIO, object_cache: ObjectCache) -> None:
        super().__init__(buffer)
        self._object_cache = object_cache

    def persistent_load(self, pid: Any) -> Any:
        """Return the record of a number."""
        return self._object_cache.find(pid)
