"""The anti-aliasing filter of a frame file: its ``filter_*`` arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray
from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.signal.filters import (
    AntiAliasingFilter,
    ButterworthFilter,
    MeasuredFilter,
    NoFilter,
    RaisedCosineFilter,
)

_KINDS = ("raised_cosine", "butterworth", "none", "measured")
_MAX_POINTS = 2**20
_DEFAULT_ROLLOFF = 0.25
_DEFAULT_ORDER = 8


def default_filter(sample_rate_hz: float) -> RaisedCosineFilter:
    """Return the filter that an estimator assumes where a frame names none.

    A raised cosine with its half amplitude at a quarter of the sample rate and a roll-off of 0.25,
    as in both simulations of the paper.

    Examples
    --------
    >>> default_filter(10.2e6)
    RaisedCosineFilter(cutoff_hz=2550000.0, rolloff=0.25)
    """
    return RaisedCosineFilter(cutoff_hz=sample_rate_hz / 4.0, rolloff=_DEFAULT_ROLLOFF)


def read_filter(archive: Archive, beat_sign: int) -> AntiAliasingFilter | None:
    """Read the filter; None where the file names none.

    Parameters
    ----------
    archive : Archive
        The frame file.
    beat_sign : int
        +1 if the frame is conjugated on reading: G then belongs to the mirrored frequency.

    Raises
    ------
    InputError
        If the kind is unknown or one of its values is missing or out of range.
    """
    if "filter_kind" not in archive:
        stray = next((key for key in archive.names() if key.startswith("filter_")), None)
        if stray is not None:
            raise InputError(
                f"{archive.name} holds {stray} but no filter_kind; one of {', '.join(_KINDS)} is "
                "needed."
            )
        return None
    kind = archive.text("filter_kind")
    if kind == "none":
        return NoFilter()
    if kind == "raised_cosine":
        rolloff = archive.number("filter_rolloff", _DEFAULT_ROLLOFF)
        return RaisedCosineFilter(cutoff_hz=archive.number("filter_cutoff_hz"), rolloff=rolloff)
    if kind == "butterworth":
        return ButterworthFilter(
            cutoff_hz=archive.number("filter_cutoff_hz"),
            order=archive.whole_number("filter_order", _DEFAULT_ORDER),
        )
    if kind == "measured":
        return _read_measured(archive, beat_sign)
    raise InputError(
        f"{archive.name}: filter_kind is {kind[:40]!r}; it must be one of {', '.join(_KINDS)}."
    )


def filter_arrays(anti_aliasing_filter: AntiAliasingFilter, beat_sign: int) -> dict[str, Any]:
    """Return the ``filter_*`` arrays that `read_filter` turns into the same filter.

    `anti_aliasing_filter`: one of this package's four kinds, in the paper's sign; `beat_sign`: sign
    in which the file keeps its signals.
    """
    arrays: dict[str, Any] = {"filter_kind": anti_aliasing_filter.kind}
    if isinstance(anti_aliasing_filter, RaisedCosineFilter):
        arrays["filter_cutoff_hz"] = anti_aliasing_filter.cutoff_hz
        arrays["filter_rolloff"] = anti_aliasing_filter.rolloff
    elif isinstance(anti_aliasing_filter, ButterworthFilter):
        arrays["filter_cutoff_hz"] = anti_aliasing_filter.cutoff_hz
        arrays["filter_order"] = anti_aliasing_filter.order
    elif isinstance(anti_aliasing_filter, MeasuredFilter):
        frequency_hz, response = _in_sign(
            anti_aliasing_filter.frequency_hz, anti_aliasing_filter.samples, beat_sign
        )
        arrays["filter_frequency_hz"] = frequency_hz
        arrays["filter_response"] = response
    return arrays


def _read_measured(archive: Archive, beat_sign: int) -> MeasuredFilter:
    frequency_hz = archive.array("filter_frequency_hz", max_elements=_MAX_POINTS)
    response = archive.array("filter_response", max_elements=_MAX_POINTS)
    for key, array, kinds in (
        ("filter_frequency_hz", frequency_hz, "iuf"),
        ("filter_response", response, "iufc"),
    ):
        _require_vector(archive.name, key, array, kinds)
    mirrored = _in_sign(frequency_hz.astype(np.float64), response.astype(np.complex128), beat_sign)
    return MeasuredFilter(frequency_hz=mirrored[0], response=mirrored[1])


def _require_vector(name: str, key: str, array: NDArray[Any], kinds: str) -> None:
    if array.ndim != 1 or array.dtype.kind not in kinds:
        raise InputError(
            f"{name}: {key} has type {array.dtype} and {array.ndim} axes; a list of numbers is "
            "needed."
        )


def _in_sign(
    frequency_hz: FloatArray, response: ComplexArray, beat_sign: int
) -> tuple[FloatArray, ComplexArray]:
    """Turn a response between the paper's sign and a file's; its own inverse.

    Conjugating a signal turns a filter G(f) into conj(G(-f)).
    """
    if beat_sign == -1:
        return frequency_hz, response
    return -frequency_hz[::-1], np.conj(response[::-1])
