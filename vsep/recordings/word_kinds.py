"""Words of another kind than was said, told by their histogram.

Samples lie around the middle of a converter's range. Where words of one kind are read as another
they lie in two heaps at the ends instead.
"""

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray

HEAPS: Final = 0.5  # share of words in the outer quarters from which they are two heaps ...
EMPTY: Final = 0.02  # ... with less than this in the middle
SHORT_WORDS: Final = (12, 14)
FEWEST: Final = 256  # words that a histogram needs
_BITS_APART = 1.0  # by how much more the high byte must vary than the low one


class Words(NamedTuple):
    """Signed words, how many bits they have, and whether none is negative."""

    values: NDArray[np.int32]
    bits: int
    is_unsigned: bool
    remarks: tuple[str, ...]


def signed_words(
    words: NDArray[np.uint16], lost: BoolArray | None, *, unsigned: bool, bits: int
) -> Words:
    """Turn 16-bit words as stored into signed ones.

    Parameters
    ----------
    words : (W,) uint16
        As the file holds them.
    lost : (W,) bool or None
        Which of them to leave out of account.
    unsigned : bool
        Whether the format's words are 2^15 too high.
    bits : int
        Of the converter, as the settings say.
    """
    kept = words if lost is None else words[~lost]
    remarks = []
    if kept.size >= FEWEST and _bytes_are_swapped(kept):
        words, kept = words.byteswap(), kept.byteswap()
        remarks.append(
            "The bytes of the words are swapped (the low one varies less than the high one); they "
            "are taken as big-endian."
        )
    if kept.size >= FEWEST and not unsigned and bits == 16 and kept.max() < 2 ** SHORT_WORDS[-1]:
        short = next(each for each in SHORT_WORDS if kept.max() < 2**each)
        if two_heaps(kept, short):
            bits = short
            remarks.append(
                f"The words lie between 0 and {2**short - 1}, in two heaps at both ends: they are "
                f"signed words of {short} bits, taken as adc_bits: {short}."
            )
    signed = words.view(np.int16).astype(np.int32)
    if bits < 16:
        half = 2 ** (bits - 1)
        of_all = kept.view(np.int16)
        if kept.size and not unsigned and (of_all.min() < -half or of_all.max() >= 2 * half):
            remarks.append(
                f"adc_bits is {bits}, but the words reach from {of_all.min()} to {of_all.max()}; "
                "they are taken as 16 bits."
            )
            return Words(signed, 16, False, tuple(remarks))
        if unsigned:
            signed = words.astype(np.int32) - 2**15
        return Words((signed + half) % (2 * half) - half, bits, False, tuple(remarks))
    shifted = np.uint16(2**15)
    # Signed words have their heaps at both ends of the unsigned range, which is right.
    looked_at = kept if unsigned else kept - shifted
    if kept.size >= FEWEST and two_heaps(looked_at, 16):
        unsigned = not unsigned
        kind, other = ("unsigned", "signed") if unsigned else ("signed", "unsigned")
        remarks.append(
            f"Read as {other} words the samples lie in two heaps at both ends of the range; they "
            f"are taken as {kind}."
        )
    if unsigned:
        signed = words.astype(np.int32) - 2**15
    # Words of a short unsigned converter are positive ones as they stand.
    present = signed if lost is None else signed[~lost]
    positive = bool(kept.size >= FEWEST and present.min() >= 0 and present.max() > 0)
    return Words(signed, bits, positive, tuple(remarks))


def two_heaps(words: NDArray[Any], bits: int) -> bool:
    """Whether words between 0 and 2^bits lie at both ends of this range, none in the middle.

    Examples
    --------
    >>> two_heaps(np.array([3, 65530, 12, 65500]), 16), two_heaps(np.array([30000, 33000]), 16)
    (True, False)
    """
    place = words.astype(np.float64) / 2**bits
    outer = float(np.mean((place < 0.25) | (place >= 0.75)))
    middle = float(np.mean((place > 0.375) & (place < 0.625)))
    both = min(float(np.mean(place < 0.5)), float(np.mean(place >= 0.5)))
    return outer > HEAPS and middle < EMPTY and both > 0.05


def wrapped(samples: NDArray[Any]) -> tuple[NDArray[Any], str]:
    """Return samples with their sign, where an array holds words that lost it.

    The remark is empty, and the samples are as they were, where they do not look so.
    """
    parts = _parts(samples)
    if parts.size < FEWEST or parts.min() < 0 or np.any(parts != np.rint(parts)):
        return samples, ""
    highest = float(parts.max())
    for bits in (*SHORT_WORDS, 16):
        if 2.0 ** (bits - 1) <= highest < 2.0**bits and two_heaps(parts, bits):
            whole = 2.0**bits
            signed = np.where(parts >= whole / 2, parts - whole, parts)
            values = signed[0] + 1j * signed[1] if samples.dtype.kind == "c" else signed[0]
            return values, (
                f"The values lie between 0 and {highest:.0f}, in two heaps at both ends: signed "
                f"words of {bits} bits that were read as unsigned. {whole:.0f} is taken off those "
                f"from {whole / 2:.0f} on."
            )
    return samples, ""


def is_unsigned(samples: NDArray[Any]) -> bool:
    """Whether no value of an array is negative, in both parts of complex ones."""
    parts = _parts(samples)
    return bool(parts.size >= FEWEST and parts.min() >= 0 and parts.max() > 0)


def _parts(samples: NDArray[Any]) -> NDArray[np.float64]:
    if samples.dtype.kind == "c":
        return np.stack([samples.real, samples.imag]).astype(np.float64)
    return samples[None].astype(np.float64)


def _bytes_are_swapped(words: NDArray[np.uint16]) -> bool:
    """Whether the low byte varies less than the high one; words with empty low bits do not tell."""
    low, high = words & 0xFF, words >> 8
    if np.all(low % 4 == 0):
        return False
    return _entropy(low) < _entropy(high) - _BITS_APART


def _entropy(values: NDArray[Any]) -> float:
    share = np.bincount(values, minlength=256) / values.size
    share = share[share > 0.0]
    return float(-np.sum(share * np.log2(share)))
