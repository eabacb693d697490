"""Waveforms of other radars, recognised from the bursts of a separated frame.

Bursts of one slope belong to one radar. Equal chirps cross the band at times on a line over the
ramps, hopping ones anywhere; two slopes that take turns are two profiles, or up and down chirps.
Ramps that no chirps explain hold another waveform, see `vsep.inference.noise_waveforms`. What fits
none of these is not recognised.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.state import BurstComponents, SeparationState
from vsep.inference.noise_waveforms import noise_waveform
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.radar import ChirpSequence

NOISE_LIKE: Final = "no-chirps"
NOT_RECOGNISED: Final = "not-recognised"
LABELS: Final = {NOISE_LIKE: "No chirps", NOT_RECOGNISED: "Not recognised"}
"""What is no key of `vsep.parameters.WAVEFORMS`."""
FEWEST: Final = 3  # bursts or ramps that tell a waveform
WEAKEST: Final = 0.03  # of the energy of the ramp's strongest burst: what is looked at
SURE: Final = 0.7  # share of the bursts that must fit
ON_LINE: Final = 0.02  # of a ramp: how far a crossing may lie from the line
ANYWHERE: Final = 0.08  # of a ramp: standard deviation of crossings that hop
MOST_ASIDE: Final = 0.5  # of the samples of chirps: samples that they do not explain
BAND: Final = 0.5  # of the sample rate, the usual pass band


@dataclass(frozen=True, kw_only=True, slots=True)
class RecognisedWaveform:
    """One radar, by what it sends.

    Parameters
    ----------
    waveform : str
        One of `vsep.parameters.WAVEFORMS`, `NOISE_LIKE` or `NOT_RECOGNISED`.
    share : float
        Of the bursts, or of the interfered ramps, that are as this waveform has them: the evidence.
    num_bursts : int
        Its bursts; for `NOISE_LIKE` the ramps.
    """

    waveform: str
    share: float
    num_bursts: int


def recognised_waveforms(
    state: SeparationState, radar: ChirpSequence, received: ComplexArray | None = None
) -> tuple[RecognisedWaveform, ...]:
    """Say what the other radars of a frame send.

    Parameters
    ----------
    state : SeparationState
        At the end of a run.
    radar : ChirpSequence
        The victim.
    received : (P, N) or (A, P, N) complex, optional
        The frame, by which interference that is no chirps is named.

    Returns
    -------
    tuple of RecognisedWaveform
        The radars of chirps with most bursts first; empty without interference.
    """
    found = []
    if state.noise_like is not None:
        ramps = np.unique(np.flatnonzero(state.noise_like.any(axis=1)) % radar.num_ramps)
        others = {burst.ramp for burst in state.bursts} - set(ramps.tolist())
        share = len(ramps) / (len(ramps) + len(others))
        name = NOT_RECOGNISED
        if share >= SURE and len(ramps) >= FEWEST:
            name = _noise_like_name(state, radar, received) or NOISE_LIKE
        found.append(RecognisedWaveform(waveform=name, share=share, num_bursts=len(ramps)))
    bursts = _strong(state.bursts)
    if not bursts:
        return tuple(found)
    if _set_aside(state) > MOST_ASIDE * sum(_length(burst, radar) for burst in bursts):
        # Chirps explain a part only.
        unknown = RecognisedWaveform(waveform=NOT_RECOGNISED, share=0.0, num_bursts=len(bursts))
        found.append(unknown)
        return tuple(found)
    groups = [group for group in _by_slope(bursts) if len(group) >= FEWEST]
    for one, other in combinations(groups, 2):
        share = _taking_turns(one, other)
        if share >= SURE:
            groups = [group for group in groups if group is not one and group is not other]
            name = _of_two_slopes(one, other, radar)
            count = len(one) + len(other)
            found.append(RecognisedWaveform(waveform=name, share=share, num_bursts=count))
            break
    found += [_of_one_slope(group, radar) for group in groups]
    if not found:
        found = [RecognisedWaveform(waveform=NOT_RECOGNISED, share=0.0, num_bursts=len(bursts))]
    return tuple(sorted(found, key=lambda each: -each.num_bursts))


def _noise_like_name(
    state: SeparationState, radar: ChirpSequence, received: ComplexArray | None
) -> str | None:
    """Name interference that is no chirps, by the first antenna."""
    if received is None or state.noise_like is None:
        return None
    own = state.noise_like[: radar.num_ramps]
    ramps = np.flatnonzero(own.any(axis=1))
    rows = received.reshape(-1, radar.num_samples)[ramps] - state.object_signal[ramps]
    return noise_waveform(rows, own[ramps], 1.0 / state.noise_precision, radar)


def _set_aside(state: SeparationState) -> int:
    """Count samples that no source explains, without those of `NOISE_LIKE` interference."""
    if state.sample_weights is None:
        return 0
    aside = state.sample_weights == 0.0
    if state.noise_like is not None:
        aside = aside & ~state.noise_like
    return int(np.count_nonzero(aside))


def _length(burst: BurstComponents, radar: ChirpSequence) -> float:
    """Return for how many samples a burst lasts."""
    return min(BAND / abs(burst.slope), float(radar.num_samples))


def _strong(bursts: Sequence[BurstComponents]) -> list[BurstComponents]:
    """Bursts of the first antenna without what a fit adds to strong ones."""
    own = [burst for burst in bursts if burst.antenna == 0 and burst.num_components]
    loudest: dict[int, float] = {}
    for burst in own:
        loudest[burst.ramp] = max(loudest.get(burst.ramp, 0.0), burst.energy)
    return [burst for burst in own if burst.energy >= WEAKEST * loudest[burst.ramp]]


def _by_slope(bursts: list[BurstComponents]) -> list[list[BurstComponents]]:
    """Bursts of nearly one slope together, most bursts first; short ones tell it less exactly."""
    ordered = sorted(bursts, key=lambda burst: burst.slope)
    groups = [[ordered[0]]]
    for burst in ordered[1:]:
        last = groups[-1][-1]
        steepness = min(abs(burst.slope), abs(last.slope))
        close = burst.slope - last.slope < (0.02 + steepness / BAND) * steepness
        if close and burst.slope * last.slope > 0.0:
            groups[-1].append(burst)
        else:
            groups.append([burst])
    parted = [part for group in groups for part in _one_a_ramp(group)]
    return sorted(parted, key=len, reverse=True)


def _one_a_ramp(group: list[BurstComponents]) -> list[list[BurstComponents]]:
    """Part bursts of one slope of which every ramp holds several, in the order of crossing."""
    several = round(len(group) / len({burst.ramp for burst in group}))
    if several < 2:
        return [group]
    parts: list[list[BurstComponents]] = [[] for _ in range(several)]
    for ramp in {burst.ramp for burst in group}:
        inside = sorted((b for b in group if b.ramp == ramp), key=lambda burst: burst.centre)
        for place, burst in enumerate(inside):
            parts[min(place, several - 1)].append(burst)
    return parts


def _taking_turns(one: list[BurstComponents], other: list[BurstComponents]) -> float:
    """Share of the interfered ramps, in their order, in which two slopes take turns."""
    first, second = ({burst.ramp for burst in group} for group in (one, other))
    order = sorted(first | second)
    if first & second or len(order) < 2 * FEWEST:
        return 0.0
    own = np.array([ramp in first for ramp in order])
    return float(np.mean(own[1:] != own[:-1]))


def _of_two_slopes(
    one: list[BurstComponents], other: list[BurstComponents], radar: ChirpSequence
) -> str:
    """Up and down chirps have slopes of both signs, beside that of the victim."""
    victim = radar.slope_hz_per_s / radar.sample_rate_hz**2
    sent = [victim + float(np.median([b.slope for b in group])) for group in (one, other)]
    return "up-and-down-chirps" if sent[0] * sent[1] < 0.0 else "two-profiles"


def _of_one_slope(group: list[BurstComponents], radar: ChirpSequence) -> RecognisedWaveform:
    """Equal chirps, where crossings lie on a line, or hopping ones."""
    num_samples = radar.num_samples
    ramps = np.array([burst.ramp for burst in group], dtype=np.float64)
    centres = np.array([burst.centre for burst in group])
    if isinstance(radar.migration, RampDither):
        # Where they would be in equal ramps
        victim = radar.slope_hz_per_s / radar.sample_rate_hz**2
        slopes, own = np.array([burst.slope for burst in group]), ramps.astype(np.int64)
        late = (radar.ramp_times_s - radar.ramp_period_s * np.arange(radar.num_ramps))[own]
        higher = victim * radar.migration.samples[own]
        centres -= (higher - (victim + slopes) * late * radar.sample_rate_hz) / slopes
    rest = _from_line(ramps, centres)
    share = float(np.mean(np.abs(rest) < ON_LINE * num_samples))
    name = "chirps"
    if share < SURE:
        name, share = "hopping-chirps", 1.0 - share
        if share < SURE or np.std(rest) < ANYWHERE * num_samples:
            name = NOT_RECOGNISED
    return RecognisedWaveform(waveform=name, share=share, num_bursts=len(group))


def _from_line(ramps: FloatArray, centres: FloatArray) -> FloatArray:
    """Distances from the line through the medians of all pairs, which outliers hardly move."""
    rows, columns = np.triu_indices(len(ramps), 1)
    apart = ramps[columns] != ramps[rows]
    if not apart.any():
        return np.asarray(centres - np.median(centres))
    rows, columns = rows[apart], columns[apart]
    slope = np.median((centres[columns] - centres[rows]) / (ramps[columns] - ramps[rows]))
    rest = centres - slope * ramps
    return np.asarray(rest - np.median(rest))
