"""From the axes of a recording to (antennas, ramps, samples) of one frame.

Transmitters that take turns make virtual antennas: those of the first transmitter come first. Ramp
r of transmitter t was the ramp ``r num_transmitters + t`` on the air.
"""

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.recordings.settings import RecordingSettings

AXES: Final = ("frames", "transmitters", "antennas", "ramps", "samples", "iq", "iiqq")
_USUAL: Final = {1: ("samples",), 2: ("ramps", "samples"), 3: ("antennas", "ramps", "samples")}


def of_one_chirp(settings: RecordingSettings) -> tuple[RecordingSettings, tuple[str, ...]]:
    """Take the frames of an array without ramps for these, and say so."""
    names = [name.strip() for name in (settings.axes or "").split(",")]
    if "frames" not in names or "ramps" in names or settings.frame or settings.num_ramps == 1:
        return settings, ()
    axes = ",".join("ramps" if name == "frames" else name for name in names)
    return replace(settings, axes=axes), (
        "axes names frames and no ramps, one chirp a frame: the frames are taken for the ramps of "
        f"one, {settings.ramp_period_s:g} s apart by ramp_period_s; num_ramps: 1 keeps the first "
        "one alone.",
    )


def arranged(path: str, array: NDArray[Any], settings: RecordingSettings) -> NDArray[Any]:
    """Choose a frame of a stored array and put its axes in order.

    Raises `InputError` if the names do not fit the array, or its lengths not the settings.

    Returns (ramps, antennas, samples) array: the ramps of all transmitters in turn.
    """
    names = _names(path, array, settings)
    if "iiqq" in names:
        array, names = _paired(path, array, names)
    if "iq" in names:
        array, names = _combined(path, array, names)
    if "frames" in names:
        place = names.index("frames")
        if settings.frame >= array.shape[place]:
            raise InputError(
                f"{path} holds {array.shape[place]} frames; frame {settings.frame} is not among "
                "them."
            )
        array = np.take(array, settings.frame, axis=place)
        names = tuple(name for name in names if name != "frames")
    elif settings.frame:
        raise InputError(f"frame is {settings.frame}, but axes names no frames.")
    wanted = ("ramps", "transmitters", "antennas", "samples")
    present = [name for name in wanted if name in names]
    array = array.transpose([names.index(name) for name in present])
    lengths = dict(zip(present, array.shape, strict=True))
    ramps, transmitters, antennas, samples = (lengths.get(name, 1) for name in wanted)
    _require_lengths(path, lengths, settings)
    return array.reshape(ramps * transmitters, antennas, samples)


def virtual_antennas(ramps: NDArray[Any], num_transmitters: int) -> NDArray[Any]:
    """Split ramps that transmitters sent in turn, (ramps, antennas, samples).

    Raises `InputError` if the ramps are no whole number of turns.

    Returns (antennas, ramps, samples) array: transmitter by transmitter, contiguous.

    Examples
    --------
    >>> virtual_antennas(np.arange(4).reshape(4, 1, 1), 2)[:, :, 0]
    array([[0, 2],
           [1, 3]])
    """
    count, antennas, samples = ramps.shape
    if count % num_transmitters:
        raise InputError(
            f"num_transmitters is {num_transmitters}, but the frame has {count} ramps, which is no "
            "whole number of turns."
        )
    turns = ramps.reshape(count // num_transmitters, num_transmitters, antennas, samples)
    split = np.moveaxis(turns, 0, 2)
    return np.ascontiguousarray(split.reshape(num_transmitters * antennas, -1, samples))


def _names(path: str, array: NDArray[Any], settings: RecordingSettings) -> tuple[str, ...]:
    if settings.axes is None:
        if array.ndim not in _USUAL:
            raise InputError(
                f"{path} holds an array of {array.ndim} axes; name them by axes, of "
                f"{', '.join(AXES)}."
            )
        return _USUAL[array.ndim]
    names = tuple(name.strip() for name in settings.axes.split(","))
    unknown = [name for name in names if name not in AXES]
    if unknown or len(set(names)) != len(names) or len({"samples", "iiqq"} & set(names)) != 1:
        raise InputError(
            f"axes is {settings.axes[:60]!r}; it must name samples and others of "
            f"{', '.join(AXES)} (samples and iq as I I Q Q), each once, with commas between."
        )
    if len(names) != array.ndim:
        shape = " x ".join(str(length) for length in array.shape[:8])
        raise InputError(f"axes names {len(names)} axes, but {path} holds an array of {shape}.")
    return names


def _paired(
    path: str, array: NDArray[Any], names: tuple[str, ...]
) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Make an axis of samples and one of I and Q of words ``I(n) I(n+1) Q(n) Q(n+1)``."""
    place = names.index("iiqq")
    length = array.shape[place]
    if length % 4 or array.dtype.kind == "c" or "iq" in names:
        raise InputError(
            f"{path}: the axis iiqq has length {length} of type {array.dtype}; it must hold real "
            "numbers, two of I and two of Q in turn."
        )
    words = np.moveaxis(array, place, -1)
    ordered = np.moveaxis(words.reshape(*words.shape[:-1], length // 4, 2, 2), -2, -1)
    samples = ordered.reshape(*words.shape[:-1], length // 2, 2)
    others = tuple(name for name in names if name != "iiqq")
    return samples, (*others, "samples", "iq")


def _combined(
    path: str, array: NDArray[Any], names: tuple[str, ...]
) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Make complex samples of an axis that holds I and Q."""
    place = names.index("iq")
    if array.shape[place] != 2 or array.dtype.kind == "c":
        raise InputError(
            f"{path}: the axis iq has length {array.shape[place]} of type {array.dtype}; it must "
            "hold two real numbers, I and Q."
        )
    first, second = np.moveaxis(array, place, 0)
    samples = np.empty(first.shape, dtype=np.complex128)
    samples.real, samples.imag = first, second
    return samples, tuple(name for name in names if name != "iq")


def _require_lengths(path: str, lengths: dict[str, int], settings: RecordingSettings) -> None:
    """Compare the array's lengths with what the settings say of them."""
    ramps = lengths.get("ramps", 1) * lengths.get("transmitters", 1)
    for key, found, wanted in (
        ("num_samples", lengths["samples"], settings.num_samples),
        ("num_ramps", ramps, settings.num_ramps),
    ):
        if wanted is not None and wanted != found:
            raise InputError(
                f"{key} is {wanted}, but {path} holds {found}; check axes, which are taken to be "
                f"{', '.join(f'{name} {length}' for name, length in lengths.items())}."
            )
    if lengths.get("transmitters", settings.num_transmitters) != settings.num_transmitters:
        raise InputError(
            f"num_transmitters is {settings.num_transmitters}, but {path} holds "
            f"{lengths['transmitters']}."
        )
