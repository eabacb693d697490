"""Prior of extended objects: groups of points against points that are each on their own.

Points of a frame are a Poisson process over range and velocity, and so are groups (a Poisson
cluster process). The points of a group are normal around a centre, with a standard deviation that
is one of a few between those of a small and a large object; how many there are is geometric from
`min_points` on. It is the structured prior of J. Moederl, F. Pernkopf, K. Witrisal and E. Leitinger
(IEEE Trans. Signal Processing, 2025), spectral lines in groups of a common parameter, each active
or not, with centre and size as the group's parameters.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from vsep._typing import FloatArray

NUM_SCALES: Final = 8


@dataclass(frozen=True, kw_only=True, slots=True)
class GroupPrior:
    """What an extended object is expected to be.

    Parameters
    ----------
    min_points : int
        Points of a group at least.
    mean_points : float
        Usual number of points.
    range_std_m, velocity_std_mps : (float, float)
        Smallest and largest standard deviation of a group's points.
    max_extent_m : float
        No group is longer.
    num_groups : float
        Groups that are expected in a frame.
    """

    min_points: int = 3
    mean_points: float = 5.5
    range_std_m: tuple[float, float] = (0.25, 1.4)
    velocity_std_mps: tuple[float, float] = (0.03, 0.2)
    max_extent_m: float = 6.0
    num_groups: float = 1.0


CAR: Final = GroupPrior()
"""Three to eight scattering centres over a few metres that move together."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Points:
    """Where points are, how well that is known, and where others may be.

    Parameters
    ----------
    ranges_m, velocities_mps : (L,) float
        The points.
    range_std_m, velocity_std_mps : (L,) float
        Their standard deviations; velocities of a single ramp have infinite ones.
    range_span_m, velocity_span_mps : float
        What the radar tells apart; velocities are alike that differ by the second, infinite where
        they are not.
    """

    ranges_m: FloatArray
    velocities_mps: FloatArray
    range_std_m: FloatArray
    velocity_std_mps: FloatArray
    range_span_m: float
    velocity_span_mps: float

    def velocities_around(self, index: int) -> FloatArray:
        """(L,) velocities of all points to that of one of them."""
        apart = self.velocities_mps - self.velocities_mps[index]
        if not math.isfinite(self.velocity_span_mps):
            return np.asarray(apart)
        return np.asarray(apart - self.velocity_span_mps * np.rint(apart / self.velocity_span_mps))


def log_density(values: FloatArray, stds: FloatArray, scales: tuple[float, float]) -> float:
    r"""Logarithm of the density of values around a common centre that may be anywhere.

    For one scale s it is ``prod N(z_i; c, s^2 + sigma_i^2)`` integrated over c; the mean over
    `NUM_SCALES` scales, equally spaced in their logarithm, is taken.

    Examples
    --------
    >>> import numpy as np
    >>> near, far = np.array([0.0, 0.5, 1.0]), np.array([0.0, 5.0, 10.0])
    >>> log_density(near, np.zeros(3), (0.3, 2.0)) > log_density(far, np.zeros(3), (0.3, 2.0))
    True
    """
    low, high = np.log(scales)
    variances = np.exp(2.0 * np.linspace(low, high, NUM_SCALES))[:, None] + stds**2
    weights = 1.0 / variances
    total = weights.sum(axis=1)
    centres = (weights @ values) / total
    squares = np.sum(weights * (values - centres[:, None]) ** 2, axis=1)
    turns = math.log(2.0 * math.pi)
    logs = 0.5 * (np.log(weights).sum(axis=1) - np.log(total) - squares)
    return float(np.logaddexp.reduce(logs)) - math.log(NUM_SCALES) - 0.5 * (len(values) - 1) * turns


def log_odds(members: list[int], points: Points, prior: GroupPrior = CAR) -> float:
    """Logarithm of the odds that points are one group, to each being on its own.

    Parameters
    ----------
    members : list of int
        Indices of the points.
    points : Points
        All points of the frame; how many there are sets the density of those on their own.
    prior : GroupPrior
        Of groups.

    Returns
    -------
    float
        Minus infinity where there are too few of them or they lie too far apart.
    """
    count, ranges = len(members), points.ranges_m[members]
    if count < prior.min_points or np.ptp(ranges) > prior.max_extent_m:
        return -math.inf
    further = prior.mean_points - prior.min_points
    log_number = count - prior.min_points
    log_count = log_number * math.log(further / (further + 1.0)) - math.log(further + 1.0)
    odds = math.log(prior.num_groups) + log_count + math.lgamma(count + 1.0)
    odds += log_density(ranges, points.range_std_m[members], prior.range_std_m)
    area = points.range_span_m
    stds = points.velocity_std_mps[members]
    if np.isfinite(stds).all():
        velocities = points.velocities_around(members[0])[members]
        odds += log_density(velocities, stds, prior.velocity_std_mps)
        span = points.velocity_span_mps
        area *= span if math.isfinite(span) else max(float(np.ptp(points.velocities_mps)), 1.0)
    alone = max(len(points.ranges_m), 1)
    return odds - math.log(area) - count * math.log(alone / area)
