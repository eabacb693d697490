"""Bursts of many interferers at once: bases of U Psi, their tangents, and the signals they make.

Interferers of a map differ in slope, in the number of interfered ramps and in the filter; the paths
and the time scheme are the same. So the interferer of the most ramps is made, and one of fewer
has its first ones. Every burst is one row, whatever interferer it belongs to.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.kernels.burst_bases import burst_bases
from vsep.separability.objects import ObjectTable
from vsep.signal.bursts import cross_while_on, overlapping_passages
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel
from vsep.signal.template import SignalModel


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Interferers:
    """Several interferers that differ in slope and filter."""

    sequences: Sequence[InterfererSequence]  #: B of them, with one time scheme
    filters: Sequence[RaisedCosineFilter]  #: B of them; equal ones next to each other
    #: the S numbers of ramps that maps have, ascending; the last one is that of the sequences
    ramp_counts: tuple[int, ...]

    def select(self, chosen: slice) -> "Interferers":
        """Return some of them."""
        return replace(self, sequences=self.sequences[chosen], filters=self.filters[chosen])


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BurstRows:
    """Bursts of several interferers, one a row."""

    #: B S: every interferer has a key for the ramps up to the first of the numbers of ramps, one
    #: for those from there to the second, ...
    num_keys: int
    #: (M,) which key, ascending, and which of the victim's ramps
    keys: IntArray
    ramps: IntArray
    #: (M, K + 2, N) orthonormal basis of the span of U Psi, a dependent column being zero, and the
    #: derivatives of U Psi beta by theta, orthonormal, as real vectors, to each other and the basis
    vectors: ComplexArray
    signals: ComplexArray  #: (M, N) U Psi beta, up to the level that the SIR sets


def make_bursts(radar: ChirpSequence, channel: Channel, interferers: Interferers) -> BurstRows:
    """Make the bursts of interferers with common paths, (12) with (39) and (41).

    `radar`: the victim; `channel`: paths from every interferer to the victim; `interferers`: who
    makes them.
    """
    sequences, counts = interferers.sequences, interferers.ramp_counts
    common = overlapping_passages(radar, sequences[0])
    starts_hz = np.array([sequence.start_frequency_hz for sequence in sequences])
    slopes = np.array([sequence.slope_hz_per_s for sequence in sequences])
    cutoffs_hz = np.array([each.cutoff_hz for each in interferers.filters])[:, None]
    carriers_hz = (starts_hz - radar.start_frequency_hz)[:, None]
    courses_hz = carriers_hz + slopes[:, None] * common.offsets_s
    differences = slopes - radar.slope_hz_per_s
    found = cross_while_on(
        radar,
        sequences[0].ramp_duration_s,
        common.offsets_s,
        (courses_hz, differences[:, None]),
        cutoffs_hz,
    )
    owners, passages = np.nonzero(found)
    own_ramps = common.interferer_ramps[passages]
    # Keys ascend by interferer and, within it, by the number of ramps that takes a burst in.
    keys = owners * len(counts) + np.searchsorted(counts, own_ramps, side="right")
    order = np.argsort(keys, kind="stable")
    owners, passages, own_ramps = owners[order], passages[order], own_ramps[order]
    templates, derivatives = _templates(
        radar, interferers.filters, owners, courses_hz[owners, passages], differences[owners]
    )
    ramp_times = np.asarray(sequences[0].ramp_period_s * own_ramps, dtype=np.float64)
    timing = common.offsets_s[passages], ramp_times
    weights = _path_weights(starts_hz[owners], slopes[owners], channel, timing)
    frequencies = slopes[owners, None] * channel.delays_s / radar.sample_rate_hz
    made = burst_bases(templates, derivatives, frequencies, weights)
    return BurstRows(
        num_keys=len(sequences) * len(counts),
        keys=keys[order],
        ramps=common.ramps[passages],
        vectors=made[:, :-1],
        signals=made[:, -1],
    )


def sum_by_key(values: ComplexArray | FloatArray, rows: BurstRows) -> ComplexArray:
    """Sum (M, ...) rows over the bursts of each key, (number of keys, ...)."""
    total = np.zeros((rows.num_keys, *values.shape[1:]), dtype=values.dtype)
    if len(rows.keys):
        starts = np.flatnonzero(np.diff(rows.keys, prepend=-1))
        total[rows.keys[starts]] = np.add.reduceat(values, starts, axis=0)
    return total


def stack_by_key(values: NDArray[Any], rows: BurstRows) -> NDArray[Any]:
    """Put the (M, V, ...) rows of each key below each other, (number of keys, R V, ...).

    R is the largest number of bursts that one has; what another has less is zero.
    """
    keys, num_keys = rows.keys, rows.num_keys
    counts = np.bincount(keys, minlength=num_keys)
    most = int(counts.max(initial=0))
    shape = num_keys, most * values.shape[1], *values.shape[2:]
    if np.all(counts == most):
        return values.reshape(shape)
    place = np.arange(len(keys)) - (np.cumsum(counts) - counts)[keys]
    stacked = np.zeros((num_keys, most, *values.shape[1:]), dtype=values.dtype)
    stacked[keys, place] = values
    return stacked.reshape(shape)


def on_lines(rows: BurstRows, table: ObjectTable) -> ComplexArray:
    """Inner products of the vectors with all columns of a table, (M, K + 2, C, U)."""
    num_bursts, num_vectors, num_samples = rows.vectors.shape
    flat = rows.vectors.conj().reshape(-1, num_samples)
    shape = num_bursts, num_vectors, table.num_lines
    lines = (flat @ table.beat_lines.T).reshape(shape)
    slopes = (flat @ table.beat_slopes.T).reshape(shape)
    doppler = table.doppler_lines.T[rows.ramps][:, None, :]
    products = np.empty((num_bursts, num_vectors, table.num_kinds, table.num_lines), dtype=complex)
    np.multiply(doppler, lines, out=products[:, :, 0])
    np.multiply(table.amplitudes * doppler, slopes, out=products[:, :, 1])
    if table.num_kinds == 3:
        doppler_slopes = table.doppler_slopes.T[rows.ramps][:, None, :]
        np.multiply(table.amplitudes * doppler_slopes, lines, out=products[:, :, 2])
    return products


def _templates(
    radar: ChirpSequence,
    filters: Sequence[RaisedCosineFilter],
    owners: IntArray,
    starts_hz: FloatArray,
    slopes: FloatArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Templates (M, N) of bursts and their derivatives (M, 2, N), filter by filter."""
    rate = radar.sample_rate_hz
    starts, bends = starts_hz / rate, slopes / rate**2
    templates = np.empty((len(owners), radar.num_samples), dtype=np.complex128)
    derivatives = np.empty((len(owners), 2, radar.num_samples), dtype=np.complex128)
    changes = [n for n in range(len(filters)) if n == 0 or filters[n] != filters[n - 1]]
    edges = np.searchsorted(owners, [*changes, len(filters)]).tolist()
    for number, first, last in zip(changes, edges[:-1], edges[1:], strict=True):
        model = SignalModel.of_radar(radar, filters[number])
        some = slice(first, last)
        templates[some], derivatives[some] = model.template_jet(
            starts[some], bends[some], -starts[some] / bends[some]
        )
    return templates, derivatives


def _path_weights(
    starts_hz: FloatArray,
    slopes: FloatArray,
    channel: Channel,
    timing: tuple[FloatArray, FloatArray],
) -> ComplexArray:
    """(M, K) weights beta of the paths at the first sample, with the constant phase of (39).

    The timing are the ages of the interferer's ramps there, and when these start.
    """
    offsets, ramp_times = (each[:, None] for each in timing)
    first, slope = starts_hz[:, None], slopes[:, None]
    turns = (first + 0.5 * slope * offsets) * offsets
    turns = turns - (first + slope * offsets) * channel.delays_s - channel.dopplers_hz * ramp_times
    return np.asarray(channel.weights * np.exp(2j * np.pi * turns))
