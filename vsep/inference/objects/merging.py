"""Objects that their neighbours explain: a strong line that several components share.

While bursts are not modelled yet, what is wrong about a strong object is explained by weaker
components next to it. Each has a large activation ratio, because the others' frequencies are taken
for known; with all weights *and* frequencies unknown its weight is not told from zero. At the end
of a run such a component is given up, and its neighbours move by what that tells about them.
"""

from typing import Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.inference.core.progress import EventKind
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.refinement import PlacedComponents, joint_step, place_components
from vsep.inference.objects.workspace import ObjectWorkspace
from vsep.signal.atoms import gram, gram_between, moved_atoms
from vsep.signal.dithered_atoms import coupled_jets

STILL_DEVIATIONS: Final = 0.1  # objects that move less stand still
LATE, PERIOD = 20, 5  # iterations: runs that do not settle are looked at from here on
KEEP: Final = 0.8  # of its threshold: an object with less evidence is given up
RIDGE: Final = 1e-10  # relative to the information of each unknown
# After one is given up, the others move together, until a step promises less.
SETTLING_STEPS, LEAST_GAIN = 10, 0.1  # at most; nats
# So many unresolved ones are one smear, whose others have too far to go for these steps.
SMEARED, SMEAR_PATIENCE = 3, 3.0  # times what an object may lose


def merging_due(objects: ObjectWorkspace, state: SeparationState) -> bool:
    """Whether a step from this state, which made these objects, looks for unresolved ones.

    It does where the run may end with it, and now and then where it does not settle.
    """
    still = objects.max_frequency_change < STILL_DEVIATIONS
    settled = still and all(event.kind is EventKind.OBJECT_REJECTED for event in objects.events)
    late = state.iteration >= LATE and state.iteration % PERIOD == 0
    return settled or late or state.calm_iterations > 0


def merge_unresolved(objects: ObjectWorkspace) -> bool:
    """Give up the objects that their neighbours explain; return whether there were any.

    Parameters
    ----------
    objects : ObjectWorkspace
        After a step; changed in place.
    """
    if len(objects.ids) < 2:
        return False
    shape = objects.placed.factors[1].shape[1], objects.placed.factors[0].shape[1]
    groups = cells_in_common(objects.points, shape)
    crowded = np.flatnonzero(np.bincount(groups) > 1)
    crowds = [objects.ids[groups == group] for group in crowded]
    return any([_merge_group(objects, ids) for ids in crowds])


def _merge_group(objects: ObjectWorkspace, ids: IntArray) -> bool:
    """Give up the least certain object of a group as long as the evidence for it is too little."""
    merged = False
    while len(members := np.flatnonzero(np.isin(objects.ids, ids))) > 1:
        placed = objects.placed
        least = KEEP * objects.threshold.ratio * objects.threshold.levels(placed.points[members, 0])
        points = placed.points.copy()
        points[members], ratios = without_weakest(placed, members, least)
        unresolved = int(np.count_nonzero(ratios < least))
        if unresolved == 0:
            break
        weakest = members[np.argmin(ratios / least)]
        kept = np.arange(len(points)) != weakest
        trial = _settled(
            place_components(
                points[kept],
                np.delete(placed.active.precisions, weakest),
                objects.residual,
                placed.active.noise_precision,
                placed.background,
                placed.migration,
            ),
            objects.residual,
        )
        lost = placed.active.explained() - trial.active.explained()
        patience = SMEAR_PATIENCE if unresolved >= SMEARED else 1.0
        if lost >= patience * least[members == weakest]:
            break
        objects.forget(kept, np.full(len(points), lost))
        objects.placed, merged = trial, True
    return merged


def _settled(placed: PlacedComponents, residual: ComplexArray) -> PlacedComponents:
    """Move all objects together until they stand still."""
    for _ in range(SETTLING_STEPS):
        moved = joint_step(placed, residual)
        if moved is placed or moved.active.cost() - placed.active.cost() < LEAST_GAIN:
            return moved
        placed = moved
    return placed


def cells_in_common(points: FloatArray, shape: tuple[int, int]) -> IntArray:
    """Find groups of points (L, 2), each closer than a cell to another one; return their numbers.

    Examples
    --------
    >>> import numpy as np
    >>> cells_in_common(np.array([[0.10, 0.0], [0.13, 0.0], [0.11, 0.0]]), (1, 64))
    array([0, 1, 0])
    """
    apart = points[:, None] - points
    apart -= np.rint(apart)
    near = np.all(np.abs(apart) * (shape[1], shape[0]) < 1.0, axis=2)
    if np.count_nonzero(near) == len(points):  # each on its own, as mostly
        return np.arange(len(points))
    groups = connected_components(csr_array(near), directed=False)[1]
    return np.asarray(groups, dtype=np.int64)


def without_weakest(
    placed: PlacedComponents, members: IntArray, least: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Places of a group's objects without the least certain one.

    Weights and frequencies x have the covariance V = J^-1 of their Fisher information. Weight l is
    told from zero by ``x_l^T V_ll^-1 x_l / 2``, which for a line on its own is its activation
    ratio. Where it is zero, the others are at ``x - V_l V_ll^-1 x_l``.

    Parameters
    ----------
    placed : PlacedComponents
        All objects.
    members : (K,) int
        Those of the group.
    least : (K,) float
        What the ratio of an object must reach.

    Returns
    -------
    points : (K, 2) float
    ratios : (K,) float
        Of all, linear.
    """
    weights = placed.active.amplitudes[members].reshape(len(members), -1)
    count = len(members)
    information = _information(placed, members)
    # Coincident objects make it singular: their difference is not known at all.
    information[np.diag_indices(len(information))] *= 1.0 + RIDGE
    covariance = np.linalg.inv(information)
    points = placed.points[members]
    # Real parts, then imaginary ones, antenna after antenna; then the frequencies.
    start = np.concatenate([part for row in weights.T for part in (row.real, row.imag)])
    values = np.concatenate([start, points.T.ravel()])[: len(covariance)]
    columns = np.arange(len(start)).reshape(-1, count)
    gains = [np.linalg.solve(covariance[np.ix_(own, own)], values[own]) for own in columns.T]
    ratios = np.array([values[columns[:, k]] @ gains[k] / 2.0 for k in range(count)])
    weakest = int(np.argmin(ratios / least))
    values = values - covariance[:, columns[:, weakest]] @ gains[weakest]
    frequencies = values[len(start) :].reshape(-1, count).T
    points[:, : frequencies.shape[1]] = frequencies
    return points, ratios


def _information(placed: PlacedComponents, members: IntArray) -> FloatArray:
    """Fisher information J of the members' weights and frequencies, in the order of `values`."""
    own, crossed, moved = _grams(placed, members)
    weights = placed.active.amplitudes[members].reshape(len(members), -1)
    count, num_antennas = weights.shape
    num_axes = len(moved) // count
    size = 2 * num_antennas * count
    information = np.zeros((size + len(moved), size + len(moved)))
    by_weight = np.block([[own.real, -own.imag], [own.imag, own.real]])
    for antenna, weight in enumerate(np.tile(weights.T, num_axes)):
        part = slice(2 * antenna * count, 2 * (antenna + 1) * count)
        slopes = crossed * weight  # Phi^H B
        information[part, part] = by_weight
        information[part, size:] = np.concatenate([slopes.real, slopes.imag])
        information[size:, size:] += (weight.conj()[:, None] * moved * weight).real  # Re B^H B
    information[size:, :size] = information[:size, size:].T
    return 2.0 * placed.active.noise_precision * information


def _grams(
    placed: PlacedComponents, members: IntArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Phi^H Phi, Phi^H D and D^H D of the members, with derivatives D orthogonal to their atoms.

    A frequency that turns its atom's phase, too, would take what is known of the weight.
    """
    num_ramps, num_samples = placed.factors[1].shape[1], placed.factors[0].shape[1]
    if placed.migration.coupling == 0.0:
        factors = placed.factors[0][members], placed.factors[1][members]
        slopes = moved_atoms(factors, np.ones(len(members), dtype=np.complex128))
        return gram(*factors), gram_between(factors, slopes), gram(*slopes)
    jets = coupled_jets(placed.points[members], placed.migration, num_ramps, num_samples, 6)
    own, by_beat, by_doppler, *second = jets
    # The jets are derivatives by the first atom, those by the second have the other sign.
    crossed = -np.concatenate([by_beat, by_doppler], axis=1)
    moved = -np.block([[second[0], second[1]], [second[1], second[2]]])
    turned = np.concatenate([np.diagonal(by_beat), np.diagonal(by_doppler)])  # -phi_l^H dphi_l
    twice, both = np.tile(own, (2, 2)), np.tile(crossed, (2, 1))
    moved = moved + turned.conj()[:, None] * both + both.conj().T * turned
    moved += turned.conj()[:, None] * twice * turned
    return own, crossed + np.tile(own, 2) * turned, moved
