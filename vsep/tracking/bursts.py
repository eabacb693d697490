"""Bursts of a frame whose objects are known: searched, and given the channel of the last frame.

An interferer is known by its slope. The paths from it to the receiver hardly change from frame to
frame, so a burst that is found begins with the channel bins of the last frame's burst of its slope;
those that its own ramp does not confirm are pruned at once. The bursts are fitted to what the
objects leave before both sources are estimated together.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.inference.core.progress import EventKind
from vsep.inference.core.search_cache import SearchCache, empty_search_cache
from vsep.inference.core.state import BurstComponents, SeparationState
from vsep.inference.core.stopwatch import BURSTS, SEARCH, part
from vsep.inference.factorised import FactorisedSeparator
from vsep.tracking.interfered_samples import raised_rows

SAME_SLOPE = 0.1  # relative difference: bursts of one interferer
MOST_FITS = 3
FEW_ADDED = 0.05  # of the channel components: fewer new ones, and the channels are complete


def fitted_bursts(
    separator: FactorisedSeparator,
    received: ComplexArray,
    state: SeparationState,
    last: Sequence[BurstComponents],
    interfered: BoolArray,
) -> SeparationState:
    """State with the bursts that a frame holds beside its objects.

    Parameters
    ----------
    separator : FactorisedSeparator
        Settings, with the schedule of the run that follows.
    received : (A P, N) complex
        The frame.
    state : SeparationState
        With the objects of the frame and without bursts.
    last : sequence of BurstComponents
        The bursts of the last frame.
    interfered : (A P, N) bool
        Samples that hold more than objects and noise.
    """
    residual = received - state.object_signal
    if separator.missing is not None:
        residual = np.where(separator.missing, 0.0, residual)
    state = replace(state, search_cache=_quiet_ramps(separator, residual, state, interfered))
    found = separator.interference_workspace(state)
    if last:
        found.known_slopes = np.array([burst.slope for burst in last])
    with part(SEARCH):
        separator.search(found, received, state)
    precision = separator.burst_precision(state, state.noise_precision)
    found.recompute(residual, precision)
    num_bins = separator.model.num_grid_bins
    bursts = found.frozen_bursts()
    bursts = bursts.with_channels([_with_channel(burst, last, num_bins) for burst in bursts])
    state = replace(state, bursts=bursts, search_cache=found.search_cache)
    work = separator.interference_workspace(state)
    with part(BURSTS):
        for _ in range(MOST_FITS):
            before = len(work.events)
            work.update(residual, precision)
            kinds = [event.kind for event in work.events[before:]]
            if kinds.count(EventKind.CHANNEL_ADDED) <= FEW_ADDED * len(work.table.owners):
                break
    left = residual - work.signal
    return replace(
        state,
        bursts=work.frozen_bursts(),
        interference_signal=work.signal,
        search_cache=_quiet_ramps(separator, left, state, np.zeros_like(interfered)),
    )


def _quiet_ramps(
    separator: FactorisedSeparator,
    left: ComplexArray,
    state: SeparationState,
    interfered: BoolArray,
) -> SearchCache:
    """Return that ramps need no search where nothing is left of them but noise.

    A burst that raises the power in no window of its ramp does the objects no harm.
    """
    noise = 1.0 / state.noise_precision
    loud = raised_rows(left.real**2 + left.imag**2, noise) | interfered.any(axis=1)
    num_antennas = separator.model.num_antennas
    quiet = np.flatnonzero(~loud.reshape(num_antennas, -1).any(axis=0))
    rows = left if num_antennas == 1 else left.reshape(num_antennas, -1, left.shape[1])
    return empty_search_cache(rows).searched(quiet, rows, np.zeros(len(quiet)))


def _with_channel(
    burst: BurstComponents, last: Sequence[BurstComponents], num_bins: int
) -> BurstComponents:
    """Give a burst of one component the channel of the last frame's burst of its slope."""
    donors = [each for each in last if each.num_components and each.antenna == burst.antenna]
    if len(donors) == 0 or burst.num_components != 1:
        return burst
    apart = np.abs(np.array([each.slope for each in donors]) / burst.slope - 1.0)
    donor = donors[int(np.argmin(apart))]
    if apart.min() > SAME_SLOPE:
        return burst
    strongest = int(np.argmax(np.abs(donor.amplitudes)))
    # The search puts the strongest path at delay zero.
    bins = donor.active_bins - donor.active_bins[strongest] + burst.active_bins[0]
    level = np.abs(donor.amplitudes[strongest] / burst.amplitudes[0]) ** 2
    return replace(
        burst,
        active_bins=bins % num_bins,
        amplitudes=donor.amplitudes / np.sqrt(level),
        covariance=donor.covariance / level,
        precisions=donor.precisions * level,
    )
