"""Tracks: objects followed from frame to frame, with names and standard deviations.

A track holds radial distance and velocity with their covariance and follows them by a Kalman filter
of constant velocity; what an estimator finds in a frame is its measurement. An object that a frame
does not show is predicted on for a few frames, and takes its name back where one is found at the
predicted place.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from vsep._typing import FloatArray, IntArray, frozen
from vsep.inference.core.state import SeparationState
from vsep.inference.deviations import state_deviations
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

CONFIRMED_HITS = 3  # frames in which an object must be found before its track counts
MOST_MISSED = 8  # frames in a row without the object, then its track ends
TENTATIVE_MISSED = 1  # the same before it is confirmed
ACCELERATION_STD_MPS2 = 6.0  # of a braking or passing car
GATE = 16.0  # squared deviations between prediction and measurement: one in 3000 is more
UNKNOWN_VARIANCE = 1e60  # of what a frame does not show
FASTEST_MPS = 40.0  # deviation of a velocity that a single ramp does not show
OWN_CELLS = 1.5  # resolution cells by which a component may miss its own track's prediction
NEAR_CELLS = 0.5  # resolution cells: closer than this an object is the same whatever its deviation


class Measured(NamedTuple):
    """Objects of one frame in m and m/s, (L,) each, with variances, and their component ids."""

    component_ids: "np.ndarray[tuple[int], np.dtype[np.int64]]"
    ranges_m: FloatArray
    velocities_mps: FloatArray
    range_variances: FloatArray
    velocity_variances: FloatArray
    snr: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One object over several frames.

    Parameters
    ----------
    track_id : int
        Its name, never given to another object.
    component_id : int
        Of the component that it was last seen as, see `ObjectComponents`.
    mean : (2,) float
        Radial distance in m and velocity in m/s, positive for a receding object.
    covariance : (2, 2) float
        Of these.
    snr : float
        Component SNR when it was last seen, linear.
    hits : int
        Frames that have shown it.
    missed : int
        Frames in a row, up to now, that have not.
    born : int
        Number of the first frame that has shown it.
    """

    track_id: int
    component_id: int
    mean: FloatArray
    covariance: FloatArray
    snr: float
    hits: int
    missed: int
    born: int

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("mean", "covariance"):
            object.__setattr__(self, name, frozen(np.array(getattr(self, name), np.float64)))

    @property
    def range_m(self) -> float:
        """Radial distance, m."""
        return float(self.mean[0])

    @property
    def velocity_mps(self) -> float:
        """Radial velocity, m/s."""
        return float(self.mean[1])

    @property
    def range_std_m(self) -> float:
        """Standard deviation of the distance, m."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def velocity_std_mps(self) -> float:
        """Standard deviation of the velocity, m/s."""
        return float(np.sqrt(self.covariance[1, 1]))

    @property
    def is_confirmed(self) -> bool:
        """Whether enough frames have shown it: a false alarm does not come back."""
        return self.hits >= CONFIRMED_HITS

    @property
    def is_over(self) -> bool:
        """Whether it has been missed too often."""
        return self.missed > (MOST_MISSED if self.is_confirmed else TENTATIVE_MISSED)


def measured_objects(state: SeparationState, radar: ChirpSequence) -> Measured:
    """Objects of a separated frame with the variances of their places.

    Parameters
    ----------
    state : SeparationState
        The end of a run.
    radar : ChirpSequence
        The victim, which gives the units.
    """
    objects = state.objects
    std = state_deviations(state, radar.shape, radar.migration)
    cell_m, cell_mps = resolution_cells(radar)
    velocities = radar.velocity_from_doppler(objects.dopplers)
    return Measured(
        component_ids=objects.component_ids,
        ranges_m=radar.range_from_beat(objects.beats),
        velocities_mps=velocities,
        range_variances=(std.beats * radar.num_samples * cell_m) ** 2,
        velocity_variances=(std.dopplers * radar.num_ramps * cell_mps) ** 2,
        snr=state.component_snr,
    )


def resolution_cells(radar: ChirpSequence) -> tuple[float, float]:
    """Resolution in distance, m, and radial velocity, m/s; the latter is infinite for one ramp."""
    metres = 0.5 * SPEED_OF_LIGHT_MPS * radar.sample_rate_hz / abs(radar.slope_hz_per_s)
    if radar.num_ramps == 1:
        return metres / radar.num_samples, np.inf
    speed = 0.5 * SPEED_OF_LIGHT_MPS / (radar.start_frequency_hz * radar.ramp_period_s)
    return metres / radar.num_samples, speed / radar.num_ramps


class _Places(NamedTuple):
    """Means (T, 2) of tracks in m and m/s, and their covariances (T, 2, 2)."""

    means: FloatArray
    covariances: FloatArray


def _predicted(tracks: Sequence[Track], elapsed_s: float) -> _Places:
    """Places after some time at constant velocity, give or take an acceleration."""
    means = np.array([track.mean for track in tracks]).reshape(-1, 2)
    covariances = np.array([track.covariance for track in tracks]).reshape(-1, 2, 2)
    moved = np.array([[1.0, elapsed_s], [0.0, 1.0]])
    pushed = ACCELERATION_STD_MPS2 * np.array([0.5 * elapsed_s**2, elapsed_s])
    return _Places(means @ moved.T, moved @ covariances @ moved.T + np.outer(pushed, pushed))


def updated_tracks(
    tracks: tuple[Track, ...],
    found: Measured,
    radar: ChirpSequence,
    *,
    elapsed_s: float,
    next_id: int,
    frame_number: int,
) -> tuple[tuple[Track, ...], int]:
    """Tracks after another frame: followed, born, missed or ended.

    A component that goes on under its own number stays with its track unless it has jumped; the
    others are assigned to the tracks that are left, all at the least total distance.

    Parameters
    ----------
    tracks : tuple of Track
        Up to the frame before.
    found : Measured
        Objects of the frame.
    radar : ChirpSequence
        The victim.
    elapsed_s : float
        From the frame before to this one.
    next_id : int
        Name of the next new track.
    frame_number : int
        Of this frame.

    Returns
    -------
    tuple of Track
        In the order of their names.
    int
        Name of the next new track.
    """
    expected = _predicted(tracks, elapsed_s)
    partners = _partners(tracks, expected, found, radar)
    own = np.array(list(partners), dtype=np.int64)
    seen = np.array(list(partners.values()), dtype=np.int64)
    places = _followed(_Places(*(each[own] for each in expected)), found, seen)
    for values, new in zip(expected, places, strict=True):
        values[own] = new
    after = []
    for track, mean, covariance, index in zip(tracks, *expected, range(len(tracks)), strict=True):
        other = partners.get(index)
        if other is None:
            changes = {"missed": track.missed + 1}
        else:
            changes = {"missed": 0, "hits": track.hits + 1} | _shown(found, other)
        after.append(replace(track, mean=mean, covariance=covariance, **changes))
    after = [track for track in after if not track.is_over]
    for other in sorted(set(range(len(found.ranges_m))) - set(partners.values())):
        after.append(_born(found, other, next_id, frame_number))
        next_id += 1
    return tuple(after), next_id


def _distances(expected: _Places, found: Measured, radar: ChirpSequence) -> FloatArray:
    """(T, L) squared deviations between predictions and measurements; infinite out of the gate."""
    means, covariances = expected
    cells = np.array(resolution_cells(radar))
    measured = np.stack([found.ranges_m, found.velocities_mps], axis=1)
    own = np.stack([found.range_variances, found.velocity_variances], axis=1)
    apart = measured[None] - means[:, None]
    if radar.num_ramps == 1:  # velocity is not observable
        apart, own, covariances = apart[..., :1], own[:, :1], covariances[:, :1, :1]
        cells = cells[:1]
    total = covariances[:, None] + own[None, :, None, :] * np.eye(own.shape[1])
    # An object splits in two or shifts by a share of a cell where others come close.
    total = total + np.diag((NEAR_CELLS * cells) ** 2 / GATE)
    squared = np.einsum("tli,tli->tl", apart, np.linalg.solve(total, apart[..., None])[..., 0])
    return np.where(squared <= GATE, squared, np.inf)


def _partners(
    tracks: Sequence[Track],
    expected: _Places,
    found: Measured,
    radar: ChirpSequence,
) -> dict[int, int]:
    """Object of every track that one is found for."""
    cells = resolution_cells(radar)
    places = {int(number): index for index, number in enumerate(found.component_ids)}
    partners: dict[int, int] = {}
    measured = np.stack([found.ranges_m, found.velocities_mps], axis=1)
    shown = [index for index, track in enumerate(tracks) if track.component_id in places]
    if shown:
        objects = [places[tracks[index].component_id] for index in shown]
        apart = np.abs(measured[objects] - expected.means[shown])
        # A passing car changes its radial velocity faster than the gate allows.
        near = np.all(apart < OWN_CELLS * np.array(cells), axis=1).tolist()
        pairs = zip(shown, objects, near, strict=True)
        partners = {index: place for index, place, is_near in pairs if is_near}
    rows = [index for index in range(len(tracks)) if index not in partners]
    columns = sorted(set(places.values()) - set(partners.values()))
    if not rows or not columns:
        return partners
    others = Measured(**{name: values[columns] for name, values in found._asdict().items()})
    left = _distances(_Places(*(each[rows] for each in expected)), others, radar)
    for row, column in zip(*linear_sum_assignment(np.minimum(left, 2.0 * GATE)), strict=True):
        if np.isfinite(left[row, column]):
            partners[rows[row]] = columns[column]
    return partners


def _followed(expected: _Places, found: Measured, index: IntArray) -> _Places:
    """Places after the measurement of one object each, `index` (T,), by the Kalman filter."""
    variances = np.stack([found.range_variances, found.velocity_variances], axis=1)[index]
    measured = np.stack([found.ranges_m, found.velocities_mps], axis=1)[index]
    # What is not observed has no weight.
    noise = np.minimum(variances, UNKNOWN_VARIANCE)[:, None, :] * np.eye(2)
    means, covariances = expected
    gains = np.linalg.solve(covariances + noise, covariances).swapaxes(1, 2)
    apart = np.where(np.isfinite(variances), measured - means, 0.0)
    covariances = covariances - gains @ covariances
    return _Places(
        means + (gains @ apart[..., None])[..., 0],
        0.5 * (covariances + covariances.swapaxes(1, 2)),
    )


def _shown(found: Measured, index: int) -> dict[str, Any]:
    """Return what a track takes over from an object."""
    return {"component_id": int(found.component_ids[index]), "snr": float(found.snr[index])}


def _born(found: Measured, index: int, track_id: int, frame_number: int) -> Track:
    velocity_variance = found.velocity_variances[index]
    if not np.isfinite(velocity_variance):
        velocity_variance = FASTEST_MPS**2
    return Track(
        track_id=track_id,
        component_id=int(found.component_ids[index]),
        mean=np.array([found.ranges_m[index], found.velocities_mps[index]]),
        covariance=np.diag([found.range_variances[index], velocity_variance]),
        snr=float(found.snr[index]),
        hits=1,
        missed=0,
        born=frame_number,
    )
