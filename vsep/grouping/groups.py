"""Extended objects of an estimate: points that belong together, and groups below the threshold.

The estimate's objects are not changed. Points form groups by the structured prior; in what they
leave of the frame, groups are looked for that are evident as a whole although none of their lines
is. Both are joined where they overlap.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.grouping.partition import point_groups
from vsep.grouping.prior import CAR, GroupPrior, Points
from vsep.grouping.residual import Residual, residual_of, weak_lines
from vsep.grouping.windows import evident_windows
from vsep.inference.core.state import SeparationState
from vsep.inference.deviations import state_deviations
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

FALSE_GROUP_RATE: Final = 0.01
"""False groups below the threshold of points in a frame of noise."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectGroup:
    """One extended object.

    Parameters
    ----------
    members : (M,) int
        Which of the estimate's objects belong to it; none of a group below their threshold.
    ranges_m, velocities_mps, snr : (K,) float
        Its lines, members first, then lines below the threshold; component SNR, linear.
    nearest_m, farthest_m : float
        Ends of its extent.
    log_odds : float
        That it is a group, in nats: of its points by the prior, of the residual by its evidence.
    """

    members: IntArray
    ranges_m: FloatArray
    velocities_mps: FloatArray
    snr: FloatArray
    nearest_m: float
    farthest_m: float
    log_odds: float

    @property
    def num_lines(self) -> int:
        """Number of lines K."""
        return len(self.snr)

    @property
    def extent_m(self) -> float:
        """Length along the line of sight."""
        return self.farthest_m - self.nearest_m

    @property
    def range_m(self) -> float:
        """Centre of the extent."""
        return 0.5 * (self.nearest_m + self.farthest_m)

    @property
    def velocity_mps(self) -> float:
        """Mean velocity of its lines, weighted by their SNR."""
        weights = np.maximum(self.snr, 1e-3)
        return float(np.average(self.velocities_mps, weights=weights))

    @property
    def strongest(self) -> int:
        """Index of its strongest line."""
        return int(np.argmax(self.snr))


def find_groups(
    received: ComplexArray | None,
    state: SeparationState,
    radar: ChirpSequence,
    *,
    missing: BoolArray | None = None,
    false_group_rate: float = FALSE_GROUP_RATE,
    prior: GroupPrior = CAR,
) -> tuple[ObjectGroup, ...]:
    """Return the extended objects of an estimate, the nearest first.

    Parameters
    ----------
    received : (P, N) or (A, P, N) complex or None
        The frame; without it, or of dithered ramps, the estimate's objects only are looked at.
    state : SeparationState
        Of any estimator.
    radar : ChirpSequence
        Which radar received it.
    missing : (A P, N) bool, optional
        Samples that were never received.
    false_group_rate : float
        Groups below the threshold of points that a frame of noise alone may have.
    prior : GroupPrior
        What groups are like.

    Examples
    --------
    >>> import vsep
    >>> scenario, observation = vsep.simulate_preset(
    ...     "simulation-1", snr_db=30.0, sir_db=-20.0, seed=1)
    >>> model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    >>> solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)
    >>> find_groups(observation.received, solution.state, scenario.radar)
    ()
    """
    points = _points(state, radar)
    groups = [
        _group(points, state.component_snr, members, odds)
        for members, odds in point_groups(points, prior)
    ]
    if received is not None and not radar.is_dithered:
        residual = residual_of(received, state, radar, missing)
        groups = _with_weak_groups(groups, points, residual, false_group_rate)
    return tuple(sorted(groups, key=lambda group: group.range_m))


def _points(state: SeparationState, radar: ChirpSequence) -> Points:
    objects, std = state.objects, state_deviations(state, radar.shape, radar.migration)
    metres = SPEED_OF_LIGHT_MPS * radar.sample_rate_hz / (2.0 * abs(radar.slope_hz_per_s))
    mps = float(radar.velocity_from_doppler(np.ones(1))[0])
    return Points(
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=radar.velocity_from_doppler(objects.dopplers),
        range_std_m=metres * std.beats,
        velocity_std_mps=mps * std.dopplers,
        range_span_m=metres,
        velocity_span_mps=mps if radar.migration.coupling == 0.0 else np.inf,
    )


def _group(points: Points, snr: FloatArray, members: Sequence[int], log_odds: float) -> ObjectGroup:
    chosen = np.array(members, dtype=np.int64)
    ranges = points.ranges_m[chosen]
    return ObjectGroup(
        members=chosen,
        ranges_m=ranges,
        velocities_mps=points.velocities_mps[chosen],
        snr=snr[chosen],
        nearest_m=float(ranges.min()),
        farthest_m=float(ranges.max()),
        log_odds=log_odds,
    )


def _with_weak_groups(
    groups: list[ObjectGroup], points: Points, residual: Residual, rate: float
) -> list[ObjectGroup]:
    """Add groups below the threshold; one that overlaps a group of points becomes part of it."""
    places, radar = residual.places(), residual.radar
    cell_m = points.range_span_m / radar.num_samples
    snr = residual.state.component_snr
    for window in evident_windows(residual.cells, places, cell_m, rate):
        rows = residual.cells.rows_beside(window.row)
        last = window.first + window.num_cells - 1
        inside = {
            index
            for index, (row, column) in enumerate(places)
            if row in rows and window.first <= column <= last
        }
        joined = [group for group in groups if inside & set(group.members.tolist())]
        taken = {index for group in groups for index in group.members.tolist()}
        members = sorted((inside - taken).union(*(group.members.tolist() for group in joined)))
        lines = weak_lines(residual, window)
        ends = ranges = np.concatenate(
            [points.ranges_m[members], radar.range_from_beat(lines.beats)]
        )
        speeds = [points.velocities_mps[members], radar.velocity_from_doppler(lines.dopplers)]
        if len(ranges) == 0:
            continue
        if len(ranges) == 1:
            ends = radar.range_from_beat(residual.beats_of(window))
        groups = [group for group in groups if group not in joined]
        groups.append(
            ObjectGroup(
                members=np.array(members, dtype=np.int64),
                ranges_m=ranges,
                velocities_mps=np.concatenate(speeds),
                snr=np.concatenate([snr[members], lines.component_snr]),
                nearest_m=float(ends.min()),
                farthest_m=float(ends.max()),
                log_odds=window.evidence + sum(group.log_odds for group in joined),
            )
        )
    return groups
