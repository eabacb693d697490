"""Raw captures of Texas Instruments sensors: in which order the 16-bit words hold the samples.

Little-endian words without any header. DCA1000 cards write signed words:

- xWR12xx/14xx, four lanes, one for each receiver, all four present even if some are unused:
  complex ``I1 I2 I3 I4 Q1 Q2 Q3 Q4`` for every sample, real ``R1 R2 R3 R4``;
- xWR16xx/18xx/68xx, two lanes: within a ramp one receiver after the other, complex by two samples,
  ``I(n) I(n+1) Q(n) Q(n+1)``, real one by one.

TSW1400 cards write unsigned words, 2^15 too high: with xWR12xx/14xx (four lanes) complex
``I1 Q1 I2 Q2 I3 Q3 I4 Q4`` for every sample, real ``R1 R2 R3 R4``; with xWR16xx/18xx/68xx one
receiver after the other, ``I(n) Q(n)``. TDA2 boards of cascaded sensors write the former order in
signed words. Exchanging I and Q only turns the sign of the beat frequency (and the phase by a
quarter), so no setting is needed for it.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES
from vsep.recordings.captured import Captured
from vsep.recordings.layouts import (
    FOUR_LANES,
    RECEIVERS_IN_TURN,
    better_format,
    remark_of_format,
)
from vsep.recordings.missing_samples import leading_zeros, samples_before_ramp, zero_runs
from vsep.recordings.raw_bytes import RawBytes, open_raw
from vsep.recordings.saturation import remark_of_saturated, saturated_words
from vsep.recordings.settings import REAL, RecordingSettings
from vsep.recordings.word_kinds import signed_words

UNSIGNED: Final = ("tsw1400", "tsw1400-xwr16xx")
_WORD = 2  # bytes
_MANY_ZEROS, _MOST_ZEROS = 64, 2**23  # words before the first frame


def read_raw(path: str, settings: RecordingSettings) -> Captured:
    """Read one frame of a raw capture; of a file without packet headers only its bytes are read.

    Parameters
    ----------
    path : str
        The capture.
    settings : RecordingSettings
        With one of the raw formats.

    Returns
    -------
    Captured
        The largest word is one. The remarks say what the file holds beside whole frames, what is
        missing, and where the words are not what the settings say.

    Raises
    ------
    InputError
        If the file does not hold the frame or cannot be read, or is no raw capture at all.
    """
    num_samples = settings.num_samples or 0
    words_per_ramp = _words_per_ramp(settings, num_samples)
    with open_raw(path, settings.key) as source:
        place = _place(path, settings, source, _WORD * words_per_ramp)
        num_ramps, first_byte, remarks = place
        _require_size(path, num_ramps * words_per_ramp)
        stored, lost = source.words(first_byte, num_ramps * words_per_ramp)
        remarks = (*source.remarks, *remarks)
    empty = zero_runs(stored)
    if empty is not None:
        lost = empty if lost is None else lost | empty
    words = signed_words(stored, lost, unsigned=settings.format in UNSIGNED, bits=settings.adc_bits)
    half = 2 ** (words.bits - 1)
    samples = samples_of_words(words.values, settings, num_ramps)
    missing, clipped = None, None
    if lost is not None and not lost.all():
        missing = _marked(lost, settings, num_ramps)
    at_full_scale = saturated_words(words.values, words.bits)
    if at_full_scale is not None:
        clipped = _marked(at_full_scale, settings, num_ramps)
        remarks = (*remarks, remark_of_saturated(clipped))
    better = better_format(words.values, settings, num_ramps, samples_of_words)
    told = (
        _shifted(samples, missing, settings)
        if better is None
        else (remark_of_format(better, settings),)
    )
    return Captured(
        samples=samples / half,
        missing=missing if clipped is None else clipped if missing is None else missing | clipped,
        remarks=(*remarks, *words.remarks, *told),
        unit=1.0 / half,
        is_unsigned=words.is_unsigned,
        is_doubtful=better is not None,
    )


def _marked(words: BoolArray, settings: RecordingSettings, num_ramps: int) -> BoolArray:
    """Return which samples have a marked word."""
    return np.asarray(samples_of_words(words.astype(np.int32), settings, num_ramps) != 0)


def num_frames(path: str, settings: RecordingSettings) -> int:
    """Return how many whole frames a raw capture holds; one without `num_ramps`.

    Raises `InputError` if it cannot be read.
    """
    if settings.num_ramps is None:
        return 1
    words = settings.num_ramps * _words_per_ramp(settings, settings.num_samples or 0)
    with open_raw(path, settings.key) as source:
        return max(source.num_bytes - settings.skip_bytes, 0) // (_WORD * words)


def samples_of_words(
    words: NDArray[Any], settings: RecordingSettings, num_ramps: int
) -> NDArray[Any]:
    """Put words into their places, (ramps, antennas, samples), complex128 or float64.

    `words` (W,): signed values, whole ramps; `settings`: format, kind of samples, and counts;
    `num_ramps`: how many ramps the words hold.
    """
    num_antennas, num_samples = settings.num_antennas, settings.num_samples or 0
    parts = 1 if settings.samples == REAL else 2
    values = words.astype(np.float64)
    if settings.format in RECEIVERS_IN_TURN:
        # Real samples one by one, the parts of complex ones by two samples from a DCA1000.
        pair = _pair(settings)
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


def _pair(settings: RecordingSettings) -> int:
    """How many samples' I parts stand together before their Q parts."""
    return 2 if settings.format == "dca1000-xwr16xx" and settings.samples != REAL else 1


def _words_per_ramp(settings: RecordingSettings, num_samples: int) -> int:
    parts = 1 if settings.samples == REAL else 2
    if settings.format in RECEIVERS_IN_TURN:
        if num_samples % _pair(settings):
            raise InputError(f"num_samples is {num_samples}; two lanes need an even number.")
        return parts * num_samples * settings.num_antennas
    if settings.num_antennas > FOUR_LANES:
        raise InputError(
            f"num_antennas is {settings.num_antennas}; a file of format {settings.format} has "
            f"{FOUR_LANES} lanes, one for each receive antenna."
        )
    return parts * num_samples * FOUR_LANES


def _place(
    path: str, settings: RecordingSettings, source: RawBytes, ramp_bytes: int
) -> tuple[int, int, tuple[str, ...]]:
    """Ramps of the wanted frame, bytes before it, and remarks on what is left over."""
    whole_frame = (settings.num_ramps or 1) * ramp_bytes
    skipped = settings.skip_bytes
    remarks: tuple[str, ...] = ()
    if not skipped:
        skipped, remarks = _empty_start(path, source, whole_frame)
    num_bytes = max(source.num_bytes - skipped, 0)
    if settings.num_ramps is None:
        whole = num_bytes // ramp_bytes
        if settings.frame:
            raise InputError(f"frame is {settings.frame}; to choose one, num_ramps must be given.")
        if whole == 0 or (num_bytes % ramp_bytes and not skipped):
            raise InputError(
                f"{path} holds {num_bytes} bytes, which is no whole number of ramps of "
                f"{ramp_bytes} bytes; check num_samples, num_antennas and samples, or give "
                "num_ramps."
            )
        return whole, skipped, remarks
    frames = num_bytes // whole_frame
    if settings.frame >= frames:
        raise InputError(
            f"{path} holds {num_bytes} bytes, {frames} whole frames of {settings.num_ramps} ramps "
            f"({whole_frame} bytes); frame {settings.frame} is not among them: check num_samples, "
            "num_ramps, num_antennas and samples."
        )
    rest = num_bytes % whole_frame
    if rest:
        remarks += (
            f"{path} ends with {rest} bytes that are no whole frame of {whole_frame} bytes; the "
            "capture was cut off, or num_samples, num_ramps or num_antennas is wrong.",
        )
    return settings.num_ramps, skipped + settings.frame * whole_frame, remarks


def _empty_start(path: str, source: RawBytes, whole_frame: int) -> tuple[int, tuple[str, ...]]:
    """Bytes of zeros before the first frame: those that no whole frame has room for."""
    rest = source.num_bytes % whole_frame
    if not rest:
        return 0, ()
    start, _ = source.words(0, min(source.num_bytes // _WORD, _MOST_ZEROS))
    empty = _WORD * leading_zeros(start)
    if empty < max(_WORD * _MANY_ZEROS, rest - _WORD):
        return 0, ()
    # A sample may be zero as well, and zeros may reach into the frame.
    skipped = rest + (empty - rest) // whole_frame * whole_frame if empty >= rest else rest
    return skipped, (
        f"{path} begins with {empty} bytes of zeros, packets lost before the first frame; the "
        f"frames are taken to begin after {skipped} bytes (skip_bytes: {skipped}), where they fit "
        "the file's end.",
    )


def _shifted(
    samples: NDArray[Any], missing: NDArray[np.bool_] | None, settings: RecordingSettings
) -> tuple[str, ...]:
    """Say if the ramps seem to begin elsewhere than where they are taken to."""
    if missing is not None:
        return ()
    in_turn = settings.format in RECEIVERS_IN_TURN
    course = samples.reshape(-1) if in_turn else samples[:, 0].reshape(-1)
    before = samples_before_ramp(course, samples.shape[-1])
    if not before:
        return ()
    lanes = 1 if in_turn else FOUR_LANES
    parts = 1 if settings.samples == REAL else 2
    skipped = settings.skip_bytes + before * lanes * parts * _WORD
    return (
        f"The ramps seem to begin {before} samples later than they are taken to: packets were lost "
        f"before them. skip_bytes: {skipped} begins there"
        + (", or so many receivers more." if in_turn and settings.num_antennas > 1 else "."),
    )


def _require_size(path: str, num_words: int) -> None:
    if num_words > 2 * MAX_SAMPLES:
        raise InputError(
            f"{path} has {num_words} words in a frame; at most {2 * MAX_SAMPLES} are allowed: give "
            "num_ramps."
        )
