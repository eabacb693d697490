"""Activation ratios of all passive bins of a burst's channel, (23)-(24).

With the inverse Cholesky factor R of the active columns' precision matrix the moments (23)-(24) of
a candidate c are ``1/rho = lambda |c|^2 - lambda^2 |R A^H c|^2`` and the innovation ``c^H r -
lambda (R A^H c)^H R A^H r``. The rows of ``R A^H c``, whitened correlations, are kept for all bins;
a new column adds one row.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.kernels.channel import Channel
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import ComplexParts, add_scaled

NOT_EXPLAINED = 1e-9  # of a column's own energy: what the others must leave of it


class Candidates(NamedTuple):
    """All bins of one burst: ``white`` (K, M) whitened correlations with K columns, `innovation`.

    ``innovation`` is (1, M); ``explained`` (M,) is the whitened correlations' squared length.
    """

    white: ComplexParts
    innovation: ComplexParts
    explained: FloatArray


@compiled
def _add_rolled(
    weight: complex, source: ComplexParts, i: int, shift: int, target: ComplexParts, j: int
) -> None:
    """Add a weight times the conjugate row i of the source, rolled to the right, to row j."""
    real, imag = weight.real, weight.imag
    size = source.real.shape[1]
    # Bin k of the candidates sees column b at the lag k - b, cyclic in the grid.
    for first, last, back in ((0, shift, shift - size), (shift, size, shift)):
        a, b = (
            source.real[i, first - back : last - back],
            source.imag[i, first - back : last - back],
        )
        c, d = target.real[j, first:last], target.imag[j, first:last]
        for n in range(last - first):
            c[n] += real * a[n] + imag * b[n]  # weight times the conjugate
            d[n] += imag * a[n] - real * b[n]


@compiled
def _take_row(
    candidates: Candidates, row: int, projection: complex, noise_precision: float
) -> None:
    """Let the innovation and what is explained know of a whitened row, R A^H r its projection."""
    real, imag = candidates.white.real[row], candidates.white.imag[row]
    left, right = candidates.innovation.real[0], candidates.innovation.imag[0]
    along, across = noise_precision * projection.real, noise_precision * projection.imag
    explained = candidates.explained
    for c in range(len(real)):
        explained[c] += real[c] * real[c] + imag[c] * imag[c]  # |R A^H c|^2
        left[c] -= real[c] * along + imag[c] * across  # c^H r - lambda (R A^H c)^H R A^H r
        right[c] -= real[c] * across - imag[c] * along


@compiled
def all_candidates(
    products: ComplexParts,
    channel: Channel,
    projections: ComplexArray,
    factor: ComplexArray,
    noise_precision: float,
    spare: int,
) -> Candidates:
    """Moments of all bins of a burst.

    Parameters
    ----------
    products : (B + 1, M) rows
        Inner products of the burst's columns with those of all bursts, and with the residual.
    channel : Channel
        The K active columns.
    projections : (K,) complex
        Their inner products with the residual.
    factor : (K, K) complex
        R.
    noise_precision : float
        lambda.
    spare : int
        Rows kept free for columns that are added.
    """
    size, num_bins = len(projections), products.real.shape[1]
    shape, last = (size + spare, num_bins), len(products.real) - 1
    candidates = Candidates(
        ComplexParts(np.zeros(shape), np.zeros(shape)),
        ComplexParts(np.zeros((1, num_bins)), np.zeros((1, num_bins))),
        np.zeros(num_bins),
    )
    add_scaled(complex(1.0, 0.0), products, last, candidates.innovation, 0)  # c^H r of all bins
    for i in range(size):
        projection = 0.0j
        for k in range(i + 1):
            # Row i of R A^H c, one term a column
            weight = factor[i, k]
            owner, shift = channel.owners[k], channel.bins[k]
            _add_rolled(weight, products, owner, shift, candidates.white, i)
            projection += weight * projections[k]
        _take_row(candidates, i, projection, noise_precision)
    return candidates


@compiled
def best_candidate(
    candidates: Candidates, taken: BoolArray, energy: float, noise_precision: float
) -> tuple[int, float, float]:
    """Bin with the largest activation ratio (23)-(24) among those not taken.

    Returns
    -------
    best : int
    ratio, inverse_rho : float
        Its omega^2/rho and 1/rho.
    """
    innovation, explained = candidates.innovation, candidates.explained
    square, most = noise_precision * noise_precision, noise_precision * energy
    best, best_ratio, best_inverse_rho = 0, 0.0, most
    for c in range(len(explained)):
        inverse_rho = most - square * explained[c]  # (23)
        # (24): omega^2 / rho^2 = lambda^2 |innovation|^2
        power = innovation.real[0, c] ** 2 + innovation.imag[0, c] ** 2
        power *= square
        # largest omega^2/rho without a division
        if power > best_ratio * inverse_rho and inverse_rho > NOT_EXPLAINED * most and not taken[c]:
            best, best_ratio, best_inverse_rho = c, power / inverse_rho, inverse_rho
    return best, best_ratio, best_inverse_rho


@compiled
def activate(
    candidates: Candidates,
    rows: tuple[ComplexParts, int, int],
    best: int,
    pivot: float,
    noise_precision: float,
) -> None:
    """Add the whitened row of a bin that becomes active, by a step of Cholesky's factorisation.

    ``rows`` names the products of the burst with itself, its number, and the rows there are;
    the pivot is ``1/rho + gamma``.
    """
    products, burst, size = rows
    white, scale = candidates.white, 1.0 / np.sqrt(pivot)
    # New row of R A^H c: (a^H c - lambda (R A^H a)^H R A^H c) / sqrt(1/rho + gamma)
    _add_rolled(complex(scale, 0.0), products, burst, best, white, size)
    for i in range(size):
        weight = -noise_precision * scale * complex(white.real[i, best], -white.imag[i, best])
        add_scaled(weight, white, i, white, size)
    innovation = candidates.innovation
    # R A^H r of the new row
    projection = scale * complex(innovation.real[0, best], innovation.imag[0, best])
    _take_row(candidates, size, projection, noise_precision)
