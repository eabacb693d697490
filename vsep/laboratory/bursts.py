"""Bursts of many interferers at once: bases of U Psi, their tangents, and the signals they make.

Interferers of a map differ in slope, in the number of interfered ramps and in the filter; the paths
are the same. Every burst is one row, whatever interferer it belongs to. Bases come from a
Gram-Schmidt process, two passes, over all rows at once: the same as a QR factorisation each.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.laboratory.objects import ObjectTable
from vsep.signal.bursts import Passages, crossings
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel
from vsep.signal.template import SignalModel

# What is left of a column beside the earlier ones is rounding below this share of its length.
_ROUNDING = 1e-13


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BurstKey:
    """An interferer and the filter that shapes its bursts."""

    sequence: InterfererSequence
    anti_aliasing_filter: AntiAliasingFilter


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BurstRows:
    """Bursts of several interferers, one a row.

    Attributes
    ----------
    keys, ramps : (M,) int
        Which interferer, ascending, and which of the victim's ramps.
    signals : (M, N) complex
        U Psi beta, up to the level that the SIR sets.
    bases : (M, K, N) complex
        Orthonormal basis of the span of U Psi; a dependent column is zero.
    tangents : (M, 2, N) complex
        Derivatives of U Psi beta by theta, orthonormal, as real vectors, to each other and the
        bases.
    """

    keys: IntArray
    ramps: IntArray
    signals: ComplexArray
    bases: ComplexArray
    tangents: ComplexArray


def make_bursts(radar: ChirpSequence, channel: Channel, keys: Sequence[BurstKey]) -> BurstRows:
    """Make the bursts of interferers with common paths, (12) with (39) and (41).

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    channel : Channel
        Paths from every interferer to the victim.
    keys : sequence of BurstKey
        Those of one filter next to each other.
    """
    parts = [
        _of_filter(radar, channel, keys, list(group))
        for _, group in groupby(range(len(keys)), key=lambda n: keys[n].anti_aliasing_filter)
    ]
    return BurstRows(
        keys=np.concatenate([part.keys for part in parts]),
        ramps=np.concatenate([part.ramps for part in parts]),
        signals=np.concatenate([part.signals for part in parts]),
        bases=np.concatenate([part.bases for part in parts]),
        tangents=np.concatenate([part.tangents for part in parts]),
    )


def sum_by_key(values: ComplexArray | FloatArray, keys: IntArray, num_keys: int) -> ComplexArray:
    """Sum (M, ...) rows over the bursts of each interferer, (num_keys, ...)."""
    total = np.zeros((num_keys, *values.shape[1:]), dtype=values.dtype)
    if len(keys):
        starts = np.flatnonzero(np.diff(keys, prepend=-1))
        total[keys[starts]] = np.add.reduceat(values, starts, axis=0)
    return total


def stack_by_key(values: ComplexArray, keys: IntArray, num_keys: int) -> ComplexArray:
    """Put the (M, V, ...) rows of each interferer below each other, (num_keys, R V, ...).

    R is the largest number of bursts that one has; what another has less is zero.
    """
    counts = np.bincount(keys, minlength=num_keys)
    place = np.arange(len(keys)) - (np.cumsum(counts) - counts)[keys]
    most = int(counts.max(initial=0))
    stacked = np.zeros((num_keys, most, *values.shape[1:]), dtype=values.dtype)
    stacked[keys, place] = values
    return stacked.reshape(num_keys, most * values.shape[1], *values.shape[2:])


def on_lines(rows: BurstRows, vectors: ComplexArray, table: ObjectTable) -> ComplexArray:
    """Inner products of (M, V, N) vectors with all columns of a table, (M, V, C U)."""
    num_bursts, num_vectors, num_samples = vectors.shape
    flat = vectors.reshape(-1, num_samples).conj()
    shape = num_bursts, num_vectors, table.num_lines
    lines = (flat @ table.beat_lines.T).reshape(shape)
    slopes = (flat @ table.beat_slopes.T).reshape(shape)
    doppler = table.doppler_lines[:, rows.ramps].T[:, None, :]
    weights = table.amplitudes
    parts = [doppler * lines, weights * doppler * slopes]
    if table.num_kinds == 3:
        parts.append(weights * table.doppler_slopes[:, rows.ramps].T[:, None, :] * lines)
    return np.concatenate(parts, axis=2)


def _of_filter(
    radar: ChirpSequence, channel: Channel, keys: Sequence[BurstKey], members: list[int]
) -> BurstRows:
    """Make the bursts of interferers whose filter is the same."""
    used = keys[members[0]].anti_aliasing_filter
    found = [(number, crossings(radar, keys[number].sequence, used)) for number in members]
    rate = radar.sample_rate_hz
    start = np.concatenate([passages.start_frequencies_hz for _, passages in found]) / rate
    slope = np.concatenate(
        [np.full(len(passages.ramps), passages.slope_hz_per_s / rate**2) for _, passages in found]
    )
    model = SignalModel.of_radar(radar, used)
    template, derivatives = model.template_jet(start, slope, -start / slope)
    weights = np.concatenate(
        [_path_weights(keys[number].sequence, channel, passages) for number, passages in found]
    )
    interferer_slopes = np.concatenate(
        [
            np.full(len(passages.ramps), keys[number].sequence.slope_hz_per_s)
            for number, passages in found
        ]
    )
    lines = _path_lines(interferer_slopes, channel, radar)
    responses = np.matmul(weights[:, None, :], lines)
    bases = _orthonormal(template[:, None, :] * lines)
    return BurstRows(
        keys=np.repeat(np.array(members), [len(passages.ramps) for _, passages in found]),
        ramps=np.concatenate([passages.ramps for _, passages in found]),
        signals=template * responses[:, 0],
        bases=bases,
        tangents=_tangents(derivatives * responses, bases),
    )


def _path_weights(
    sequence: InterfererSequence, channel: Channel, passages: Passages
) -> ComplexArray:
    """(B, K) weights beta of the paths at the first sample, with the constant phase of (39)."""
    offset = passages.offsets_s[:, None]
    frequency = sequence.start_frequency_hz + sequence.slope_hz_per_s * offset
    ramp_time = sequence.ramp_period_s * passages.interferer_ramps[:, None]
    turns = (sequence.start_frequency_hz + 0.5 * sequence.slope_hz_per_s * offset) * offset
    turns = turns - frequency * channel.delays_s - channel.dopplers_hz * ramp_time
    return np.asarray(channel.weights * np.exp(2j * np.pi * turns))


def _path_lines(slopes: FloatArray, channel: Channel, radar: ChirpSequence) -> ComplexArray:
    """(M, K, N) lines of the paths of interferers with (M,) slopes."""
    turns = slopes[:, None, None] * channel.delays_s[:, None] * radar.sample_times_s
    return np.asarray(np.exp(-2j * np.pi * turns))


def _orthonormal(columns: ComplexArray) -> ComplexArray:
    """Orthonormal basis of the rows of every (K, N) matrix of (M, K, N), in their order."""
    bases = np.zeros_like(columns)
    for number in range(columns.shape[1]):
        column = columns[:, number]
        length = np.linalg.norm(column, axis=1)
        known = bases[:, :number]
        for _ in range(2):
            shares = np.matmul(known, column.conj()[:, :, None])[:, :, 0].conj()
            column = column - np.matmul(shares[:, None, :], known)[:, 0]
        left = np.linalg.norm(column, axis=1)
        kept = left > _ROUNDING * length
        bases[:, number] = column * np.where(kept, 1.0 / np.where(kept, left, 1.0), 0.0)[:, None]
    return bases


def _tangents(derivatives: ComplexArray, bases: ComplexArray) -> ComplexArray:
    """Make (M, 2, N) derivatives orthogonal to the bases and orthonormal as real vectors."""
    lengths = np.linalg.norm(derivatives, axis=2, keepdims=True)
    scaled = derivatives / np.where(lengths > 0.0, lengths, 1.0)
    for _ in range(2):
        shares = np.matmul(scaled, bases.conj().swapaxes(1, 2))
        scaled = scaled - np.matmul(shares, bases)
    real = np.concatenate([scaled.real, scaled.imag], axis=2).astype(np.complex128)
    basis = _orthonormal(real).real
    half = basis.shape[2] // 2
    return np.asarray(basis[:, :, :half] + 1j * basis[:, :, half:])
