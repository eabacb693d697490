"""Loss of the Cramer-Rao bound by unknown interference, for numbers of objects and delays.

The information about the objects is Re{M - S} - T: M are the inner products of the atoms and of
their derivatives, S those of their parts within span U Psi, T those of their real parts along the
tangents. Objects come one after another, the first one last.
"""

from collections.abc import Sequence

import numpy as np

from vsep._typing import FloatArray
from vsep.kernels.bordered_cholesky import inverse_triangles, last_variances
from vsep.separability.products import Products
from vsep.units import to_db

# A bound beyond this multiple is none: the loss is infinite.
_MAX_LOSS = 1e11


def bound_losses(
    own: Products, spans: Products, tangents: Products, counts: Sequence[int]
) -> FloatArray:
    """Compare the mean bounds on beat plus Doppler variance, interference unknown over known.

    `own`: of the lines, B is 1; `spans`: of their parts within span U Psi; `tangents`: of the real
    parameters' parts along the tangents; `counts`: numbers of objects. Returns (B, number of
    counts, D): in dB; infinite where the bound is.
    """
    known = own.as_real()
    unknown = own.minus(spans).as_real().minus(tangents)
    others = 1.0 / np.sqrt(np.einsum("bifif->bfi", known.among)[0])
    last = 1.0 / np.sqrt(np.einsum("biid->bid", known.within)[0])
    bound = _variance_sums(known, others, last, counts)
    ratio = _variance_sums(unknown, others, last, counts) / bound
    usable = ratio < _MAX_LOSS
    # The bound cannot fall; what lies below one is rounding.
    return np.where(usable, np.asarray(to_db(np.clip(ratio, 1.0, _MAX_LOSS))), np.inf)


def _variance_sums(
    information: Products, others: FloatArray, last: FloatArray, counts: Sequence[int]
) -> FloatArray:
    """Sum all beat and Doppler variances, (B, number of counts, D).

    `information`: of the real parameters; `others` and `last` (F, Q): units in which every
    parameter has an information of one; `counts`: numbers of objects.
    """
    (size, num_delays), length, num_keys = last.shape, others.size, len(information.within)
    scale = others.ravel()
    # Object by object, so that fewer objects are the leading rows.
    among = information.among.transpose(0, 2, 1, 4, 3).reshape(num_keys, length, length)
    across = information.across.transpose(0, 2, 1, 3, 4).reshape(num_keys, length, last.size)
    triangles = inverse_triangles(among * (scale[:, None] * scale))
    reduced = triangles @ (across * (scale[:, None] * last.reshape(-1)))
    within = information.within * (last[:, None] * last)
    wanted = np.flatnonzero(np.tile(np.arange(size) >= 2, length // size))
    weighted = triangles[:, :, wanted] * scale[wanted]
    before = np.cumsum(np.sum(weighted**2, axis=2), axis=1)
    weights = last**2 * (np.arange(size) >= 2)[:, None]
    sums = np.empty((num_keys, len(counts), num_delays))
    for place, count in enumerate(counts):
        rows = size * (count - 1)
        kept = np.count_nonzero(wanted < rows)
        moved = weighted[:, :rows, :kept].swapaxes(1, 2) @ reduced[:, :rows]
        sums[:, place] = last_variances(
            np.ascontiguousarray(reduced[:, :rows]).reshape(num_keys, rows, *last.shape),
            moved.reshape(num_keys, kept, *last.shape),
            within,
            weights,
        )
        if rows:
            sums[:, place] += before[:, rows - 1, None]
    return sums
