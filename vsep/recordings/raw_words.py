"""Raw captures of Texas Instruments sensors: in which order the 16-bit words hold the samples.

Little-endian words without any header. DCA1000 cards write signed words:

- xWR12xx/14xx, four lanes, one for each receiver, all four present even if some are unused:
  complex ``I1 I2 I3 I4 Q1 Q2 Q3 Q4`` for every sample, real ``R1 R2 R3 R4``;
- xWR16xx/18xx/68xx, two lanes: within a ramp one receiver after the other, complex by two samples,
  ``I(n) I(n+1) Q(n) Q(n+1)``, real one by one.

TSW1400 cards (xWR12xx/14xx, four lanes) write unsigned words, 2^15 too high: complex
``I1 Q1 I2 Q2 I3 Q3 I4 Q4`` for every sample, real ``R1 R2 R3 R4``. Exchanging I and Q only turns
the sign of the beat frequency (and the phase by a quarter), so no setting is needed for it.
"""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES
from vsep.files.opening import open_regular
from vsep.recordings.settings import RecordingSettings

FOUR_LANES = 4
_WORD = 2  # bytes


def read_raw(path: str, settings: RecordingSettings) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Read one frame of a raw capture; only its bytes are read.

    Parameters
    ----------
    path : str
        The capture.
    settings : RecordingSettings
        With one of the raw formats.

    Returns
    -------
    samples : (ramps, antennas, samples) complex or real
        The largest word is one.
    remarks : tuple of str
        What the file holds beside whole frames.

    Raises
    ------
    InputError
        If the file does not hold the frame or cannot be read.
    """
    num_samples = settings.num_samples or 0
    words_per_ramp = _words_per_ramp(settings, num_samples)
    with open_regular(path, path, "a recording") as file:
        num_bytes = os.fstat(file.fileno()).st_size
        num_ramps, skipped, remarks = _place(path, settings, num_bytes, _WORD * words_per_ramp)
        _require_size(path, num_ramps * words_per_ramp)
        unsigned = settings.format == "tsw1400"
        words = np.fromfile(
            file,
            dtype="<u2" if unsigned else "<i2",
            count=num_ramps * words_per_ramp,
            offset=skipped,
        ).astype(np.int32)
    if unsigned:
        words -= 2**15
    half = 2 ** (settings.adc_bits - 1)
    if settings.adc_bits < 16:
        # The converter's word lies in the low bits; its sign is not extended.
        words = (words + half) % (2 * half) - half
    return samples_of_words(words, settings, num_ramps) / half, remarks


def samples_of_words(
    words: NDArray[np.int32], settings: RecordingSettings, num_ramps: int
) -> NDArray[Any]:
    """Put words into their places, (ramps, antennas, samples), complex128 or float64.

    `words` (W,): signed values, whole ramps; `settings`: format, kind of samples, and counts;
    `num_ramps`: how many ramps the words hold.
    """
    num_antennas, num_samples = settings.num_antennas, settings.num_samples or 0
    parts = 1 if settings.samples == "real" else 2
    values = words.astype(np.float64)
    if settings.format == "dca1000-xwr16xx":
        # Real samples one by one, the parts of complex ones by two samples.
        pair = 1 if parts == 1 else 2
        ordered = values.reshape(num_ramps, num_antennas, num_samples // pair, parts, pair)
        ordered = np.moveaxis(ordered, 3, 0).reshape(parts, num_ramps, num_antennas, num_samples)
    else:
        lanes_last = settings.format == "dca1000-xwr14xx"
        shape = (parts, FOUR_LANES) if lanes_last else (FOUR_LANES, parts)
        ordered = values.reshape(num_ramps, num_samples, *shape)
        axes = (2, 0, 3, 1) if lanes_last else (3, 0, 2, 1)
        ordered = ordered.transpose(axes)[:, :, :num_antennas]
    if parts == 1:
        return np.ascontiguousarray(ordered[0])
    samples = np.empty(ordered.shape[1:], dtype=np.complex128)
    samples.real, samples.imag = ordered
    return samples


def _words_per_ramp(settings: RecordingSettings, num_samples: int) -> int:
    parts = 1 if settings.samples == "real" else 2
    if settings.format == "dca1000-xwr16xx":
        if parts == 2 and num_samples % 2:
            raise InputError(f"num_samples is {num_samples}; two lanes need an even number.")
        return parts * num_samples * settings.num_antennas
    if settings.num_antennas > FOUR_LANES:
        raise InputError(
            f"num_antennas is {settings.num_antennas}; a file of format {settings.format} has "
            f"{FOUR_LANES} lanes, one for each receive antenna."
        )
    return parts * num_samples * FOUR_LANES


def _place(
    path: str, settings: RecordingSettings, num_bytes: int, ramp_bytes: int
) -> tuple[int, int, tuple[str, ...]]:
    """Ramps of the wanted frame, bytes before it, and remarks on what is left over."""
    whole = num_bytes // ramp_bytes
    if settings.num_ramps is None:
        if settings.frame:
            raise InputError(f"frame is {settings.frame}; to choose one, num_ramps must be given.")
        if whole == 0 or num_bytes % ramp_bytes:
            raise InputError(
                f"{path} holds {num_bytes} bytes, which is no whole number of ramps of "
                f"{ramp_bytes} bytes; check num_samples, num_antennas and samples, or give "
                "num_ramps."
            )
        return whole, 0, ()
    frame_bytes = settings.num_ramps * ramp_bytes
    frames = num_bytes // frame_bytes
    if settings.frame >= frames:
        raise InputError(
            f"{path} holds {num_bytes} bytes, {frames} whole frames of {settings.num_ramps} ramps "
            f"({frame_bytes} bytes); frame {settings.frame} is not among them: check num_samples, "
            "num_ramps, num_antennas and samples."
        )
    rest = num_bytes % frame_bytes
    remark = (
        f"{path} ends with {rest} bytes that are no whole frame of {frame_bytes} bytes; the "
        "capture was cut off, or num_samples, num_ramps or num_antennas is wrong."
    )
    return settings.num_ramps, settings.frame * frame_bytes, (remark,) if rest else ()


def _require_size(path: str, num_words: int) -> None:
    if num_words > 2 * MAX_SAMPLES:
        raise InputError(
            f"{path} has {num_words} words in a frame; at most {2 * MAX_SAMPLES} are allowed: give "
            "num_ramps."
        )
