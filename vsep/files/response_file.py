"""Response files: the measured complex response of a receiver.

An ``.npz`` archive without pickles: ``filter_kind`` ("measured"), ``filter_frequency_hz`` (F,) and
``filter_response``, (antennas, F), or (F,) of a single antenna, in the sign ``beat_sign`` of the
recordings; beside them ``filter_coherence``, ``slope_difference_hz_per_s``, ``num_bursts``, and
where it comes from, ``sources`` and ``version``. A frame file may hold the first three of one
antenna as they are.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vsep._version import __version__
from vsep.errors import InputError
from vsep.files.archive import Archive, Source, naming, require_npz_name, source_name
from vsep.files.writing import write_npz
from vsep.signal.receiver_response import ReceiverResponse

_MAX_POINTS = 2**20
_MAX_SOURCES = 4096


def write_response(
    path: str | Path, response: ReceiverResponse, *, beat_sign: int, sources: Sequence[str]
) -> None:
    """Write a response file.

    Parameters
    ----------
    path
        As for `vsep.files.frame.write_frame`, with the same errors.
    response : ReceiverResponse
        In the paper's sign.
    beat_sign : int
        Sign in which the file keeps it, as for `read_frame`.
    sources : sequence of str
        Names of the recordings.
    """
    require_npz_name(path, "a response file")
    stored = _in_sign(response, beat_sign)
    single = stored.num_antennas == 1
    write_npz(
        path,
        filter_kind="measured",
        filter_frequency_hz=stored.frequency_hz,
        filter_response=stored.response[0] if single else stored.response,
        filter_coherence=stored.coherence[0] if single else stored.coherence,
        slope_difference_hz_per_s=stored.slope_difference_hz_per_s,
        num_bursts=stored.num_bursts,
        beat_sign=beat_sign,
        sources=", ".join(sources)[:_MAX_SOURCES],
        version=__version__,
    )


def read_response(source: Source, *, name: str | None = None) -> ReceiverResponse:
    """Read a response file, in the paper's sign.

    Only ``filter_frequency_hz`` and ``filter_response`` are needed; without ``beat_sign`` they are
    in the paper's sign.

    Parameters
    ----------
    source : str, Path or binary file
        The archive.
    name : str, optional
        What to call it; the path by default.

    Raises
    ------
    InputError
        In one sentence, whatever is wrong with the file.
    """
    label = source_name(source, name)
    with Archive(source, label) as archive:
        try:
            return _read(archive)
        except InputError as error:
            raise naming(label, error) from error


def _read(archive: Archive) -> ReceiverResponse:
    beat_sign = archive.beat_sign()
    frequency = archive.array("filter_frequency_hz", max_elements=_MAX_POINTS)
    response = archive.array("filter_response", max_elements=_MAX_POINTS)
    coherence = (
        archive.array("filter_coherence", max_elements=_MAX_POINTS)
        if "filter_coherence" in archive
        else np.ones(response.shape)
    )
    for key, array, kinds in (
        ("filter_frequency_hz", frequency, "iuf"),
        ("filter_response", response, "iufc"),
        ("filter_coherence", coherence, "iuf"),
    ):
        if array.dtype.kind not in kinds or array.ndim not in (1, 2):
            raise InputError(
                f"{key} has type {array.dtype} and {array.ndim} axes; numbers over frequency, or "
                "over (antennas, frequency), are needed."
            )
    stored = ReceiverResponse(
        frequency_hz=frequency,
        response=np.atleast_2d(response),
        coherence=np.atleast_2d(coherence),
        slope_difference_hz_per_s=archive.number("slope_difference_hz_per_s", 0.0),
        num_bursts=archive.whole_number("num_bursts", 0),
    )
    return _in_sign(stored, beat_sign)


def _in_sign(response: ReceiverResponse, beat_sign: int) -> ReceiverResponse:
    """Turn a response between the paper's sign and a file's; its own inverse.

    Conjugating a signal turns G(f) into conj(G(-f)) and mirrors every slope.
    """
    if beat_sign == -1:
        return response
    return ReceiverResponse(
        frequency_hz=-response.frequency_hz[::-1],
        response=response.response[:, ::-1].conj(),
        coherence=response.coherence[:, ::-1],
        slope_difference_hz_per_s=-response.slope_difference_hz_per_s,
        num_bursts=response.num_bursts,
    )
