"""Strategies for bad input: a valid example, changed a little, so that it gets far."""

import io
import json
import re
import struct
import zipfile
from collections.abc import Callable, Sequence
from copy import deepcopy
from typing import Any, TypeAlias

import numpy as np
from hypothesis import strategies as st

Content: TypeAlias = st.SearchStrategy[bytes]

NUMBERS = (
    *("0", "-1", "1e19", "1e308", "1e999", "-1e999", "NaN", "Infinity", "1e-320", "0.5", "1_0"),
    *("9" * 400, "1" + "0" * 4300, "9" * 5000, "0x" + "f" * 5000, "²", "٣", "18446744073709551616"),
)
WORDS = (
    *("null", "true", "[]", "{}", '""', "''", '"\\ud800"', "[" * 2000, "{" * 3000, "[[1, 2], [3]]"),
    *(
        "\u0000",
        "\u2028",
        "\ufeff",
        "*a",
        "&a",
        "!!python/object:os.system x",
        "1979-05-27",
        "../x",
    ),
    *("a" * 10_000, "💥", "%00", "1:2:3", "0-999999999", "<script>"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 10**19, 2**63, -(2**63), 10**400, 0.5, -0.0, 1e308, 5e-324),
    *(float("nan"), float("inf"), "", "a", "1", "fig-3", "\ud800", "x" * 5000, [], [0.5], ["a"]),
    *([[1]], {}, {"a": 1}, [None], [1e400], list(range(300))),
)
ARRAYS: tuple[Any, ...] = (
    *(np.array(value) for value in (0, -1, 1, 1e300, np.nan, np.inf, 2**62, True, 1j, "", "text")),
    *(np.zeros(0), np.zeros((0, 4)), np.zeros((4, 0), complex), np.zeros((1, 1, 1, 1))),
    *(np.zeros((4, 32)), np.full((4, 32), np.nan + 0j), np.full((4, 32), 1e200 + 0j)),
    *(np.arange(4), np.arange(4)[::-1], np.full(4, np.nan), np.array(["a", "b"]), np.ones((2, 3))),
    *(np.ones((4, 32), bool), np.array([(1, 2)], "i4,i4"), np.array(b"\xff\xfe"), np.float16(1)),
    *(np.array(0, "datetime64[s]"), np.array(1, ">f8"), np.array(2.0, "longdouble")),
)
SHAPES = ("()", "(4, 32)", "(-4, 32)", "(True, 32)", "(4.0, 32)", "(99999999999, 99)", "4", "(4,")
TYPES = ("<c16", "|O", "|V2000000", "<U999999", "|S0", "<f8", "?", "<m8[s]", "[('a', '<f8')]", "q")


@st.composite
def damaged(draw: st.DrawFn, content: bytes) -> bytes:
    """Bytes changed, left out, put in, repeated, or cut off; fields of four bytes at extremes."""
    changed = bytearray(content)
    for _ in range(draw(st.integers(1, 3))):
        place = draw(st.integers(0, max(0, len(changed) - 1)))
        length = draw(st.sampled_from((1, 2, 4, 8, 64)))
        kind = draw(st.integers(0, 6))
        if kind == 0:
            del changed[place:]
        elif kind == 1:
            del changed[place : place + length]
        elif kind == 2:
            changed[place:place] = changed[place : place + length]
        elif kind == 3:
            changed[place : place + length] = bytes(len(changed[place : place + length]))
        elif kind == 4:
            changed[place : place + 4] = struct.pack("<i", draw(st.sampled_from(_FIELDS)))
        else:
            changed[place : place + 1] = draw(st.binary(min_size=1, max_size=2))
    return bytes(changed)


_FIELDS = (0, 1, -1, 2**31 - 1, -(2**31), 14, 15, 65536, 2**24)
_TOKEN = re.compile(r"-?\d[\w.+-]*|\"[^\"]*\"|'[^']*'|[A-Za-z_][\w-]*|[^\s\w]")


@st.composite
def retold(draw: st.DrawFn, text: str) -> bytes:
    """A text with one to three of its numbers and words replaced, left out or repeated."""
    for _ in range(draw(st.integers(1, 3))):
        tokens = list(_TOKEN.finditer(text))
        if not tokens:
            break
        found = tokens[draw(st.integers(0, len(tokens) - 1))]
        is_number = found[0][0].isdigit() or found[0][0] == "-"
        first, second = (NUMBERS, WORDS) if is_number else (WORDS, NUMBERS)
        new = draw(st.sampled_from((*first, *first, *second, found[0] * 2, "")))
        text = text[: found.start()] + new + text[found.end() :]
    return text.encode("utf-8", "surrogatepass")


@st.composite
def revalued(draw: st.DrawFn, data: Any, dump: Callable[[Any], bytes]) -> bytes:
    """Data of lists and tables with one or two values replaced or taken out at any depth."""
    changed = json.loads(json.dumps(data))
    for _ in range(draw(st.integers(1, 2))):
        holder = changed
        while holder:
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            key = draw(st.sampled_from(keys))
            if isinstance(holder[key], dict | list) and draw(st.integers(0, 3)):
                holder = holder[key]
                continue
            if draw(st.integers(0, 5)):
                holder[key] = deepcopy(draw(st.sampled_from(VALUES)))
            else:
                del holder[key]
            break
    return dump(changed)


def as_bytes(data: Any) -> bytes:
    """Return data as JSON, with the NaN that JSON does not know and no limit on digits."""
    return json.dumps(data, default=str).encode()


@st.composite
def refilled(draw: st.DrawFn, arrays: dict[str, Any]) -> bytes:
    """An archive with one or two arrays of another kind, or a header that claims something else."""
    members = {key: _stored(np.asanyarray(value)) for key, value in arrays.items()}
    for _ in range(draw(st.integers(1, 2))):
        key = draw(st.sampled_from(sorted(members)))
        kind = draw(st.integers(0, 4))
        if kind == 0:
            del members[key]
            if not members:
                break
        elif kind == 1:
            members[key] = _claimed(draw(st.sampled_from(TYPES)), draw(st.sampled_from(SHAPES)))
        else:
            members[key] = _stored(draw(st.sampled_from(ARRAYS)))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for key, content in members.items():
            archive.writestr(f"{key}.npy", content)
    return file.getvalue()


def _stored(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, np.asanyarray(array), allow_pickle=False)
    return file.getvalue()


def _claimed(dtype: str, shape: str) -> bytes:
    """An array whose header claims a type and a shape."""
    quoted = dtype if dtype.startswith("[") else repr(dtype)
    text = f"{{'descr': {quoted}, 'fortran_order': False, 'shape': {shape}, }}"
    padded = text.ljust(-(-(len(text) + 11) // 64) * 64 - 11) + "\n"
    head = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(padded)) + padded.encode("latin-1")
    return head + bytes(2048)


@st.composite
def claimed_arrays(draw: st.DrawFn) -> bytes:
    """A single array with a header of any kind."""
    if draw(st.booleans()):
        return _stored(draw(st.sampled_from(ARRAYS)))
    return _claimed(draw(st.sampled_from(TYPES)), draw(st.sampled_from(SHAPES)))


def of_texts(*texts: str) -> Content:
    """Return mutations of texts."""
    return st.one_of(*(each for text in texts for each in (retold(text), damaged(text.encode()))))


def of_data(data: Sequence[Any], dump: Callable[[Any], bytes] = as_bytes) -> Content:
    """Return mutations of data and of the file that holds them."""
    kinds = [
        each
        for one in data
        for each in (revalued(one, dump), revalued(one, dump), damaged(dump(one)))
    ]
    return st.one_of(*kinds)


def of_arrays(file: bytes, arrays: dict[str, Any]) -> Content:
    """Return mutations of an archive and of its arrays."""
    return st.one_of(damaged(file), refilled(arrays), refilled(arrays))
