"""Layouts of a raw capture that nobody described, ranked by evidence.

Every order of words and lanes, real or complex samples and every length of a ramp that fits the
file are tried, and of the best ones how many receivers and transmitters take turns. That one
whose range-Doppler maps hold the echoes in the fewest cells is taken. Ramps begin where the samples
before predict nothing. Receivers or transmitters take turns if a ramp is more like a later one than
like the next one.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.errors import InputError
from vsep.recordings.frame_length import frame_length
from vsep.recordings.layout_evidence import (
    Evidence,
    cost,
    doppler_power,
    evidence,
    flatness,
    in_turns,
    noise_of,
    picture_of,
    quiet,
    ramp_likeness,
    range_spectra,
)
from vsep.recordings.layouts import FOUR_LANES, RECEIVERS_IN_TURN
from vsep.recordings.missing_samples import leading_zeros, prediction_error, zero_runs
from vsep.recordings.packets import PAYLOAD
from vsep.recordings.raw_bytes import open_raw
from vsep.recordings.raw_words import samples_of_words
from vsep.recordings.settings import COMPLEX_1X, COMPLEX_2X, REAL, RecordingSettings
from vsep.recordings.word_kinds import signed_words, two_heaps

BEST: Final = 3
MOST_WORDS: Final = 2**18
MOST_OF_FRAMES: Final = 2**22
"""Words among which frames are looked for."""
FEWEST_WORDS: Final = 2**11
LENGTHS: Final = range(16, 8193)  # of a ramp
USUAL_LENGTHS: Final = frozenset(
    odd * 2**power for odd in (1, 3, 5, 25, 125) for power in range(10) if odd * 2**power >= 64
) & frozenset(LENGTHS)
"""Tried although the file is no whole number of such ramps: it may have been cut off."""

LEAST_COST: Final = 3e-4
"""Noise alone costs 5e-5."""

_WORD = 2  # bytes
_MANY_ZEROS, _FEW_ZEROS = 64, 16  # words: packets lost before the capture; samples that are zero
_FEWEST_RAMPS = 16
_PREDICTED = 16  # samples from which the next one is predicted; not more than the least length
_JUMP = 4  # samples after a ramp's start whose prediction counts
_CERTAIN = 12.0  # times the usual: from here on a ramp begins, however large others are
_TELLING = 4.0  # how many times the usual this error must be somewhere, to tell at all
_FEWEST_TURNS = 8
_MAPPED = 40  # layouts of which maps are made, those with the least flat spectra ...
_OF_LENGTH = 0.25  # ... for their length: several ramps as one have more lines, not broader ones
_NOISE = 0.25  # quantile of these maps' noise that is taken for all
_AS_CHEAP = (
    1.15  # times the least cost: among these, of as many lanes, the spectra's flatness counts
)
# Times the cost of one lane, what four may cost: those of any order, and those that one lane's
# samples fill. Wrong ones cost nearly four times as much.
_OF_LANES, _OF_LANES_ALONE = 1.45, 1.6
_UNLIKE = 0.05  # difference between successive ramps that noise and motion make
_OF_COUNT = 0.25  # power of their number in favour of turns
_OF_TURNS = 1.55  # times the cost of fewer: what more turns may cost
_OF_ONE = 0.8  # times the cost and difference of one receiver, from which several take turns
_LANES_OF: Final = (
    ("tsw1400-xwr16xx", "tda2", "complex"),
    ("dca1000-xwr16xx", "dca1000-xwr14xx", REAL),
)
_TURNS: Final = (1, 2, 3, 4, 6, 8, 12, 16)
# Receivers and transmitters of so many channels that take turns.
_SPLIT: Final = {6: (2, 3), 8: (4, 2), 12: (4, 3), 16: (4, 4)}
_ORDERS: Final = {
    "complex": ("dca1000-xwr16xx", "dca1000-xwr14xx", "tda2", "tsw1400-xwr16xx"),
    REAL: ("dca1000-xwr16xx", "dca1000-xwr14xx"),
}


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Guess:
    """A layout, and what speaks for it."""

    #: format, samples, num_samples, num_antennas, num_transmitters, and num_ramps of a frame where
    #: moving echoes tell that there are several
    settings: dict[str, Any]
    num_ramps: int  #: of the whole file, those of all transmitters
    evidence: Evidence
    cost: float  #: what layouts are ranked by, little is good; only ratios mean anything
    picture: NDArray[np.uint8]  #: small range-Doppler map, 0 for noise

    def __str__(self) -> str:
        """Name the layout on a line."""
        said = self.settings
        counts = [
            f"{said[f'num_{name}s']} {name}{'' if said[f'num_{name}s'] == 1 else 's'}"
            for name in ("sample", "antenna", "transmitter")
        ]
        return f"{said['format']}, {said['samples']}, {', '.join(counts)}, {self.num_ramps} ramps"


class _Layout(NamedTuple):
    """An order of words with a length of the ramp."""

    format: str
    samples: str
    num_samples: int

    @property
    def lanes(self) -> int:
        return 1 if self.format in RECEIVERS_IN_TURN else FOUR_LANES

    @property
    def words(self) -> int:
        """Words of a ramp, of one receiver where receivers take turns."""
        return (1 if self.samples == REAL else 2) * self.lanes * self.num_samples

    def of(self, words: FloatArray) -> NDArray[Any]:
        """Whole ramps (ramps, lanes, samples) of words."""
        count = words.size // self.words
        settings = RecordingSettings(
            format=self.format,
            samples=self.samples,
            num_samples=self.num_samples,
            num_antennas=self.lanes,
            **_ANY_RADAR,
        )
        return samples_of_words(words[: count * self.words], settings, count)

    def whole_ramps(self, words: FloatArray, lost: BoolArray | None) -> NDArray[Any]:
        """Ramps of words; where some were lost the longest row of ramps that were not."""
        ramps = self.of(words)
        if lost is None:
            return ramps
        broken = lost[: len(ramps) * self.words].reshape(len(ramps), -1).any(axis=1)
        ends = np.flatnonzero(np.concatenate([[True], broken, [True]]))
        longest = int(np.argmax(np.diff(ends)))
        kept = ramps[ends[longest] : ends[longest + 1] - 1]
        return kept if len(kept) >= _FEWEST_RAMPS else ramps


_ANY_RADAR: Final[dict[str, Any]] = {
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 1e13,
    "sample_rate_hz": 1e7,
    "ramp_period_s": 1e-2,
}


class _Ranked(NamedTuple):
    """A layout with the receivers or transmitters that take turns, and what it was ranked by."""

    layout: _Layout
    turns: int
    noise: float
    cost: float


def guess_layouts(path: str, *, skip_bytes: int = 0, topic: str | None = None) -> tuple[Guess, ...]:
    """Return the most plausible layouts of a raw capture, the best one first.

    Of the file at most 2^18 words are looked at. Whether I comes before Q, and which of two
    receivers is which, no samples can tell.

    Parameters
    ----------
    path : str
        The capture.
    skip_bytes : int
        Before its first frame.
    topic : str, optional
        Of the messages of a ROS bag.

    Raises
    ------
    InputError
        If it is no raw capture, or too short or too quiet to tell.
    """
    with open_raw(path, topic) as source:
        total = max(source.num_bytes - skip_bytes, 0) // 2
        if total < FEWEST_WORDS:
            raise InputError(
                f"{path} holds {total} words; to guess their layout at least {FEWEST_WORDS} are "
                "needed."
            )
        begun = 0 if skip_bytes else _WORD * _empty_words(source.words(0, MOST_OF_FRAMES)[0])
        total -= begun // _WORD
        stored, lost = source.words(skip_bytes + begun, min(total, MOST_WORDS))
        of_frames, _ = source.words(skip_bytes + begun, min(total, MOST_OF_FRAMES))
    empty = zero_runs(stored)
    lost = empty if lost is None else lost if empty is None else lost | empty
    unsigned = two_heaps((stored if lost is None else stored[~lost]) - np.uint16(2**15), 16)
    signed = signed_words(stored, lost, unsigned=unsigned, bits=16).values
    words, clipped = quiet(signed if lost is None else np.where(lost, 0, signed))
    spectra = dict(_least_flat(words, lost, _candidates(clipped, total)))
    ranked = _ranked(spectra)
    if not ranked:
        raise InputError(
            f"{path} holds no echoes in any layout of its words: say the settings, or record again."
        )
    begins = {"skip_bytes": begun} if begun else {}
    found = (
        _guess(each.layout.whole_ramps(words, lost), total, each, spectra, unsigned=unsigned)
        for each in ranked
    )
    best, *others = (replace(each, settings=each.settings | begins) for each in found)
    whole = signed_words(of_frames, None, unsigned=unsigned, bits=16).values
    return _with_frames(best, ranked[0], quiet(whole)[0]), *others


def _empty_words(stored: NDArray[Any]) -> int:
    """Return how many words of zeros precede the capture; packets that were lost are whole."""
    zeros = leading_zeros(stored)
    if zeros < _MANY_ZEROS or zeros > stored.size - FEWEST_WORDS:
        return 0
    beyond = zeros % (PAYLOAD // _WORD)
    return zeros - (beyond if beyond < _FEW_ZEROS else 0)


def _with_frames(guess: Guess, ranked: _Ranked, words: FloatArray) -> Guess:
    """Add the ramps of a frame to a guess, where moving echoes tell them."""
    samples = ranked.layout.of(words)
    whole = len(samples) // ranked.turns * ranked.turns
    length = frame_length(in_turns(range_spectra(samples[:whole]), ranked.turns))
    if length is None:
        return guess
    num_ramps = length * guess.settings["num_transmitters"]
    return replace(guess, settings=guess.settings | {"num_ramps": num_ramps})


def _candidates(words: FloatArray, total: int) -> Iterator[_Layout]:
    for samples, orders in _ORDERS.items():
        for order in orders:
            lengths = []
            for length in range(LENGTHS.start, LENGTHS.stop, 2):
                layout = _Layout(order, samples, length)
                if words.size // layout.words < _FEWEST_RAMPS:
                    break
                if total % layout.words == 0 or length in USUAL_LENGTHS:
                    lengths.append(length)
            for length in _begun(_Layout(order, samples, 2), words, lengths):
                yield _Layout(order, samples, length)


def _begun(order: _Layout, words: FloatArray, lengths: list[int]) -> list[int]:
    """Return lengths at whose multiples ramps begin, as far as the samples tell.

    Where a ramp begins the samples before predict nothing. Of lengths that fit the shortest ones
    are ramps, others several of them.
    """
    samples = order.of(words)
    error = prediction_error(np.moveaxis(samples, 1, 0).reshape(order.lanes, -1), _PREDICTED)
    usual = float(np.median(error))
    if usual <= 0.0:
        return lengths
    around = np.convolve(error, np.full(_JUMP, 1.0 / _JUMP), "full")[_JUMP - 1 :] / usual
    jumps = {length: _least_jump(around, length) for length in lengths}
    most = max(jumps.values(), default=0.0)
    if most < _TELLING:
        return lengths
    least = min(math.sqrt(most), _CERTAIN)
    begun = [length for length in lengths if jumps[length] >= least]
    return [
        length
        for length in begun
        if not any(length % shorter == 0 for shorter in begun if shorter < length)
    ]


def _least_jump(error: FloatArray, length: int) -> float:
    """Return the error where ramps begin, the least of every second, third and fifth one."""
    starts = error[length - _PREDICTED :: length]
    folded = (
        np.median(starts[: len(starts) // turns * turns].reshape(-1, turns), axis=0).min()
        for turns in (2, 3, 5)
    )
    return float(min(folded))


def _least_flat(
    words: FloatArray, lost: BoolArray | None, layouts: Iterator[_Layout]
) -> Iterator[tuple[_Layout, ComplexArray]]:
    """Yield layouts with the least flat range spectra, and these."""
    found = []
    for layout in layouts:
        flat = flatness(range_spectra(layout.whole_ramps(words, lost)))
        if flat < 0.0:
            found.append((flat + _OF_LENGTH * math.log2(layout.num_samples), layout))
    for _, layout in sorted(found)[:_MAPPED]:
        yield layout, range_spectra(layout.whole_ramps(words, lost))


def _ranked(spectra: dict[_Layout, ComplexArray]) -> list[_Ranked]:
    """Return layouts in the order of their costs."""
    powers = {layout: doppler_power(ramps) for layout, ramps in spectra.items()}
    levels = [level for level in map(noise_of, powers.values()) if level > 0.0]
    if not levels:
        return []
    noise = float(np.quantile(levels, _NOISE))
    costs = {layout: cost(power, noise) for layout, power in powers.items()}
    found = [
        _Ranked(layout, 1, noise, costs[layout] / (1.0 if layout.lanes == 1 else _OF_LANES))
        for layout in costs
        if costs[layout] > LEAST_COST and not any(_are_lanes(layout, each, costs) for each in costs)
    ]
    best = sorted(found, key=lambda each: each.cost)[:BEST]
    # Where bursts cover the echoes, costs hardly differ.
    near = [
        each
        for each in best
        if each.cost <= _AS_CHEAP * best[0].cost and each.layout.lanes == best[0].layout.lanes
    ]
    if len(near) > 1:
        first = min(near, key=lambda each: flatness(spectra[each.layout]))
        best = [first, *(each for each in best if each is not first)]
    return [each._replace(turns=_turns(each.layout, spectra[each.layout], noise)) for each in best]


def _are_lanes(one: _Layout, lanes: _Layout, costs: dict[_Layout, float]) -> bool:
    """Whether the samples of one receiver are those of four lanes."""
    return (
        (one.format, lanes.format, one.samples) in _LANES_OF
        and one.samples == lanes.samples
        and one.num_samples % (FOUR_LANES * lanes.num_samples) == 0
        and costs[lanes] <= _OF_LANES_ALONE * costs[one]
    )


def _turns(layout: _Layout, ramps: ComplexArray, noise: float) -> int:
    """Return how many receivers or transmitters take turns.

    A ramp is like the next one of its channel; too many channels double the cells with echoes.
    """
    costs: dict[int, float] = {}
    found: dict[int, float] = {}
    for turns in _TURNS:
        whole = len(ramps) // turns
        if whole < _FEWEST_TURNS or layout.lanes * turns > _TURNS[-1]:
            continue
        channels = in_turns(ramps[: whole * turns], turns)
        each = cost(doppler_power(channels), noise)
        if each <= _OF_TURNS * max((costs[n] for n in costs if turns % n == 0), default=each):
            costs[turns] = each
            difference = 1.0 - ramp_likeness(channels) + _UNLIKE
            found[turns] = difference * each / turns**_OF_COUNT
    best = min(found, key=lambda turns: found[turns])
    return best if found[best] < _OF_ONE * found[1] else 1


def _guess(
    samples: NDArray[Any],
    total: int,
    ranked: _Ranked,
    spectra: dict[_Layout, ComplexArray],
    *,
    unsigned: bool,
) -> Guess:
    layout, turns, noise, ranked_by = ranked
    whole = len(samples) // turns * turns
    in_channels = in_turns(spectra[layout][:whole], turns)
    told, one_sided = evidence(in_turns(samples[:whole], turns), in_channels, noise)
    kind = layout.samples
    if kind != REAL:
        kind = COMPLEX_1X if one_sided else COMPLEX_2X
    antennas, transmitters = layout.lanes, turns
    if layout.lanes == 1:
        antennas, transmitters = _SPLIT.get(turns, (turns, 1))
    order = "tsw1400" if layout.format == "tda2" and unsigned else layout.format
    return Guess(
        settings={
            "format": order,
            "samples": kind,
            "num_samples": layout.num_samples,
            "num_antennas": antennas,
            "num_transmitters": transmitters,
        },
        num_ramps=total // (layout.words * (antennas if layout.lanes == 1 else 1)),
        evidence=told,
        cost=ranked_by,
        picture=picture_of(in_channels, noise, centred=kind == COMPLEX_2X),
    )
