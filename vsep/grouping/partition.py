"""Partition of a frame's points into groups and points on their own."""

import math

import numpy as np

from vsep.grouping.prior import CAR, GroupPrior, Points, log_odds

MOST_POINTS = 24  # of a group
EVIDENT = math.log(19.0)  # log odds of a group at least: a probability of 95 %


def point_groups(points: Points, prior: GroupPrior = CAR) -> list[tuple[list[int], float]]:
    """Return the groups among points, the most evident first, each with its log odds.

    From every point the sets of its nearest neighbours are tried; the most evident set becomes a
    group, after points have been added and taken away as long as that makes it more evident. Its
    points are not looked at again.

    Examples
    --------
    >>> import numpy as np
    >>> from vsep.grouping.prior import Points
    >>> ranges = np.array([5.0, 20.0, 20.5, 21.2, 22.0, 40.0])
    >>> speeds = np.array([0.0, 8.0, 8.02, 7.98, 8.0, 8.0])
    >>> std = np.full(6, 0.01)
    >>> points = Points(ranges_m=ranges, velocities_mps=speeds, range_std_m=std,
    ...                 velocity_std_mps=std, range_span_m=50.0, velocity_span_mps=32.0)
    >>> [members for members, _ in point_groups(points)]
    [[1, 2, 3, 4]]
    """
    free = set(range(len(points.ranges_m)))
    groups = []
    while len(free) >= prior.min_points:
        tried = [_best_around(seed, free, points, prior) for seed in sorted(free)]
        odds, members = max(tried, key=lambda each: each[0], default=(0.0, []))
        if odds > 0.0:
            odds, members = _exchanged(odds, members, free, points, prior)
        if odds <= EVIDENT:
            break
        groups.append((sorted(members), odds))
        free -= set(members)
    return groups


def _neighbours(seed: int, free: set[int], points: Points, prior: GroupPrior) -> list[int]:
    """Free points that may be of one group with a point, the nearest first, itself at first."""
    others = np.array(sorted(free))
    along = points.ranges_m[others] - points.ranges_m[seed]
    distance = (along / prior.range_std_m[1]) ** 2
    near = abs(along) <= prior.max_extent_m
    stds = points.velocity_std_mps[others]
    if np.isfinite(stds).all():
        variance = prior.velocity_std_mps[1] ** 2 + stds**2 + points.velocity_std_mps[seed] ** 2
        apart = points.velocities_around(seed)[others] ** 2 / variance
        distance, near = distance + apart, near & (apart < 25.0)
    order = np.argsort(distance[near], kind="stable")
    return [int(index) for index in others[near][order][:MOST_POINTS]]


def _best_around(
    seed: int, free: set[int], points: Points, prior: GroupPrior
) -> tuple[float, list[int]]:
    nearest = _neighbours(seed, free, points, prior)
    sets = [nearest[:count] for count in range(prior.min_points, len(nearest) + 1)]
    scored = [(log_odds(members, points, prior), members) for members in sets]
    return max(scored, key=lambda each: each[0], default=(-np.inf, []))


def _exchanged(
    odds: float, members: list[int], free: set[int], points: Points, prior: GroupPrior
) -> tuple[float, list[int]]:
    """Add and take away single points while the group becomes more evident."""
    while True:
        around = {one for seed in members for one in _neighbours(seed, free, points, prior)}
        trials = [[one for one in members if one != out] for out in members]
        trials += [[*members, one] for one in sorted(around - set(members))]
        best = max(
            ((log_odds(trial, points, prior), trial) for trial in trials), key=lambda e: e[0]
        )
        if best[0] <= odds:
            return odds, members
        odds, members = best
