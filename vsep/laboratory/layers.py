"""The layers that need no estimator, for every pair of an interferer and a set of objects.

Condition (27) in both readings, the coherence of the two bases and the loss of the Cramer-Rao
bound. All come from inner products of a few lines with the bursts; nothing of the size of a frame
is made for a pair. None depends on the SNR, and of the levels only (27) does, dB by dB.
"""

from dataclasses import dataclass

import numpy as np

from vsep._arrays import ComplexArray, FloatArray, IntArray, to_db
from vsep.laboratory.bursts import BurstRows, on_lines, stack_by_key, sum_by_key
from vsep.laboratory.objects import ObjectTable

# So many complex numbers are at work at a time, 40 MB.
_BLOCK = 2_500_000
# A bound beyond this multiple, or below zero by rounding, is none: the loss is infinite.
_LARGEST_LOSS = 1e11
_RIDGE = 1e-14


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PairLayers:
    """Layers of B interferers and O sets of objects at SIR 0 dB, each (B, O).

    Attributes
    ----------
    whole_db : array
        (27) as a ratio of norms over all objects.
    weakest_db : array
        (27) object by object, the smallest ratio.
    coherence : array
        Cosine of the smallest principal angle between span Phi and span U Psi.
    bound_loss_db : array
        Mean bound on the variance of beat and Doppler frequency, interference unknown over known.
    """

    whole_db: FloatArray
    weakest_db: FloatArray
    coherence: FloatArray
    bound_loss_db: FloatArray


def pair_layers(
    table: ObjectTable, rows: BurstRows, num_keys: int, members: IntArray
) -> PairLayers:
    """Evaluate all layers for interferers times sets of equally many objects.

    Parameters
    ----------
    table : ObjectTable
        Lines of all objects.
    rows : BurstRows
        Bursts of all interferers.
    num_keys : int
        B.
    members : (O, L) int
        Lines of every set.

    Returns
    -------
    PairLayers
        NaN for an interferer without bursts; an infinite loss where the bound is.
    """
    count = members.shape[1]
    spans = stack_by_key(on_lines(rows, rows.bases, table), rows.keys, num_keys)
    tangents = stack_by_key(on_lines(rows, rows.tangents, table), rows.keys, num_keys)
    width = table.num_kinds * count
    step = max(1, _BLOCK // (num_keys * (spans.shape[1] + 4 * width) * width))
    coherence = np.empty((num_keys, len(members)))
    loss = np.empty_like(coherence)
    for start in range(0, len(members), step):
        block = slice(start, start + step)
        columns = table.columns(members[block])
        shared = _products(spans[:, :, columns])
        bent = np.real(_products(_as_real(tangents[:, :, columns], count)))
        whitening = table.whitening(members[block])
        coherence[:, block] = _coherence(shared[..., :count, :count], whitening)
        loss[:, block] = _bound_loss(table, columns, count, shared, bent)
    whole, weakest = _condition(table, rows, num_keys, members)
    silent = np.bincount(rows.keys, minlength=num_keys) == 0
    for layer in (whole, weakest, coherence, loss):
        layer[silent] = np.nan
    return PairLayers(whole_db=whole, weakest_db=weakest, coherence=coherence, bound_loss_db=loss)


def _condition(
    table: ObjectTable, rows: BurstRows, num_keys: int, members: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Both readings of (27) at SIR 0 dB, (B, O) each."""
    # The conjugate of phi^H U Psi beta has its magnitude.
    products = on_lines(rows, rows.signals[:, None, :], table)[:, 0, : table.num_lines]
    other = np.abs(sum_by_key(products, rows.keys, num_keys)) ** 2
    energies = sum_by_key(np.sum(np.abs(rows.signals) ** 2, axis=1), rows.keys, num_keys)
    scale = 1.0 / np.maximum(np.real(energies), 1e-300)
    energy, own = table.own_projections(members)
    met = other[:, members] * scale[:, None, None] * energy[:, None]
    each = np.abs(table.amplitudes[members]) ** 2 / np.maximum(met, 1e-300)
    whole = own / np.maximum(met.sum(axis=2), 1e-300)
    return np.asarray(to_db(whole)), np.asarray(to_db(each.min(axis=2)))


def _products(values: ComplexArray | FloatArray) -> ComplexArray:
    """(B, O, C, C) inner products of the columns of (B, R, O, C) values."""
    ordered = np.ascontiguousarray(values.transpose(0, 2, 1, 3))
    return np.asarray(np.matmul(ordered.conj().swapaxes(2, 3), ordered))


def _as_real(values: ComplexArray, count: int) -> FloatArray:
    """Real inner products with the columns of the real parameters, (B, R, O, C + L)."""
    atoms = values[..., :count]
    return np.concatenate([atoms.real, -atoms.imag, values[..., count:].real], axis=-1)


def _coherence(shared: ComplexArray, whitening: ComplexArray) -> FloatArray:
    """Largest cosine: root of the largest eigenvalue of the whitened Gram matrix, (B, O)."""
    seen = whitening.conj().swapaxes(1, 2) @ shared @ whitening
    largest = np.linalg.eigvalsh(seen)[..., -1]
    return np.asarray(np.sqrt(np.clip(largest, 0.0, 1.0)))


def _bound_loss(
    table: ObjectTable,
    columns: IntArray,
    count: int,
    shared: ComplexArray,
    bent: FloatArray,
) -> FloatArray:
    """Ratio of the mean bounds with unknown and known interference in dB, (B, O)."""
    own = table.products[columns[:, :, None], columns[:, None, :]]
    known = _real_products(own, count)
    unknown = _real_products(own - shared, count) - bent
    scale = 1.0 / np.sqrt(np.diagonal(known, axis1=1, axis2=2))
    weights = scale[:, None, :] * scale[:, :, None]
    first = 2 * count
    few = scale[:, first:] ** 2
    bound_known = np.sum(_marginal_variances(known * weights, first) * few, axis=-1)
    bound_unknown = np.sum(_marginal_variances(unknown * weights, first) * few, axis=-1)
    ratio = bound_unknown / bound_known
    usable = (ratio > 0.0) & (ratio < _LARGEST_LOSS)
    # The bound cannot fall; what lies below one is rounding.
    ratio = np.maximum(np.where(usable, ratio, 1.0), 1.0)
    return np.where(usable, np.asarray(to_db(ratio)), np.inf)


def _real_products(products: ComplexArray, count: int) -> FloatArray:
    """Inner products of the columns of the real parameters: parts of the weights, then the rest."""
    chosen = np.concatenate([np.arange(count), np.arange(products.shape[-1])])
    turn = np.concatenate([np.ones(count), np.full(count, 1j), np.ones(len(chosen) - 2 * count)])
    picked = products[..., chosen[:, None], chosen[None, :]]
    return np.asarray((turn.conj()[:, None] * turn[None, :] * picked).real)


def _marginal_variances(information: FloatArray, first: int) -> FloatArray:
    """Diagonal of the inverse from a parameter on; the diagonal of what comes in is about one."""
    ridge = _RIDGE * np.eye(information.shape[-1])
    inverse = np.linalg.inv(information + ridge)
    return np.diagonal(inverse, axis1=-2, axis2=-1)[..., first:]
