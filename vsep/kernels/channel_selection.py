"""Algorithm 4 on the channel of one ramp: which columns are active, and their prior precisions.

Everything is made of inner products of columns, which FFTs give for all possible ones at once.
With the inverse Cholesky factor R of the active columns' precision matrix the moments (23)-(24) of
a candidate c are ``1/rho = lambda |c|^2 - lambda^2 |R A^H c|^2`` and the innovation ``c^H r -
lambda (R A^H c)^H R A^H r``. The rows of ``R A^H c``, whitened correlations, are kept for all bins;
a new column adds one row.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import BoolArray, ComplexArray, FloatArray
from vsep.kernels.channel import Channel, Split, add_scaled, split_rows
from vsep.kernels.compiler import compiled
from vsep.kernels.posterior import Posterior, factored_posterior, inverse_factor

NOT_EXPLAINED = 1e-9  # of a column's own energy: what the others must leave of it


class Candidates(NamedTuple):
    """All bins of one burst: ``white`` (K, M) whitened correlations with K columns, `innovation`.

    ``innovation`` is (1, M); ``explained`` (M,) is the whitened correlations' squared length.
    """

    white: Split
    innovation: Split
    explained: FloatArray


@compiled
def product_rows(templates: ComplexArray, residual: ComplexArray, scale: float) -> ComplexArray:
    """(B, B + 1, N) rows whose spectra are the inner products of all possible columns.

    Row (i, j) is for columns of burst i with those of burst j, row (i, B) with the residual.
    """
    count, num_samples = templates.shape
    rows = np.empty((count, count + 1, num_samples), dtype=np.complex128)
    for i in range(count):
        for n in range(num_samples):
            first = scale * templates[i, n].conjugate()
            for j in range(count):
                rows[i, j, n] = first * templates[j, n] / np.sqrt(num_samples)
            rows[i, count, n] = first * residual[n]
    return rows


@compiled
def gathered_products(
    products: ComplexArray, channel: Channel
) -> tuple[ComplexArray, ComplexArray]:
    """Gram matrix and projections of the columns from the products of all possible ones."""
    owners, bins = channel.owners, channel.bins
    size, count, num_bins = len(bins), len(products), products.shape[2]
    gram = np.empty((size, size), dtype=np.complex128)
    projections = np.empty(size, dtype=np.complex128)
    for i in range(size):
        projections[i] = products[owners[i], count, bins[i]]
        for j in range(size):
            lag = bins[i] - bins[j]
            lag = lag if lag >= 0 else lag + num_bins
            gram[i, j] = products[owners[i], owners[j], lag]
    return gram, projections


@compiled
def _add_rolled(weight: complex, source: Split, i: int, shift: int, target: Split, j: int) -> None:
    """Add a weight times the conjugate row i of the source, rolled to the right, to row j."""
    real, imag = weight.real, weight.imag
    size = source.real.shape[1]
    for first, last, back in ((0, shift, shift - size), (shift, size, shift)):
        a, b = (
            source.real[i, first - back : last - back],
            source.imag[i, first - back : last - back],
        )
        c, d = target.real[j, first:last], target.imag[j, first:last]
        for n in range(last - first):
            c[n] += real * a[n] + imag * b[n]
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
        explained[c] += real[c] * real[c] + imag[c] * imag[c]
        left[c] -= real[c] * along + imag[c] * across
        right[c] -= real[c] * across - imag[c] * along


@compiled
def all_candidates(
    products: Split,
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
    shape = (size + spare, num_bins)
    count = len(products.real) - 1
    candidates = Candidates(
        Split(np.zeros(shape), np.zeros(shape)),
        Split(products.real[count:].copy(), products.imag[count:].copy()),
        np.zeros(num_bins),
    )
    for i in range(size):
        projection = 0.0j
        for k in range(i + 1):
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
        inverse_rho = most - square * explained[c]
        power = innovation.real[0, c] ** 2 + innovation.imag[0, c] ** 2
        power *= square
        if power > best_ratio * inverse_rho and inverse_rho > NOT_EXPLAINED * most and not taken[c]:
            best, best_ratio, best_inverse_rho = c, power / inverse_rho, inverse_rho
    return best, best_ratio, best_inverse_rho


@compiled
def _activate(
    candidates: Candidates,
    rows: tuple[Split, int, int],
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
    _add_rolled(complex(scale, 0.0), products, burst, best, white, size)
    for i in range(size):
        weight = -noise_precision * scale * complex(white.real[i, best], -white.imag[i, best])
        add_scaled(weight, white, i, white, size)
    innovation = candidates.innovation
    projection = scale * complex(innovation.real[0, best], innovation.imag[0, best])
    _take_row(candidates, size, projection, noise_precision)


@compiled
def with_best_bins(
    products: ComplexArray,
    channel: Channel,
    noise_precision: float,
    threshold: float,
    max_additions: int,
) -> tuple[Channel, FloatArray, Posterior]:
    """Add to every burst up to some of its best bins whose activation ratio exceeds a threshold.

    Returns
    -------
    channel : Channel
        The added columns stand last.
    ratios : (A,) float
        Their activation ratios.
    fit : Posterior
        Of all columns.
    """
    ratios = np.empty(0)
    gram, projections = gathered_products(products, channel)
    factor = inverse_factor(gram, channel.precisions, noise_precision)
    for burst in range(len(products)):
        rows, size = split_rows(products[burst]), len(projections)
        candidates = all_candidates(
            rows, channel, projections, factor[0], noise_precision, max_additions
        )
        energy = products[burst, burst, 0].real
        taken = np.zeros(products.shape[2], dtype=np.bool_)
        taken[channel.bins[channel.owners == burst]] = True
        number = 0
        for _ in range(max_additions):
            best, ratio, inverse_rho = best_candidate(candidates, taken, energy, noise_precision)
            if not ratio > threshold:
                break
            taken[best] = True
            precision = inverse_rho / (ratio - 1.0)
            pivot = inverse_rho + precision
            _activate(candidates, (rows, burst, size + number), best, pivot, noise_precision)
            number += 1
            ratios = np.append(ratios, ratio)
            channel = Channel(
                np.append(channel.owners, np.int64(burst)),
                np.append(channel.bins, np.int64(best)),
                np.append(channel.precisions, precision),
                channel.twiddle,
            )
        if number > 0:
            gram, projections = gathered_products(products, channel)
            factor = inverse_factor(gram, channel.precisions, noise_precision)
    return channel, ratios, factored_posterior(gram, projections, factor, noise_precision)


@compiled
def reweighed(
    fit: Posterior, precisions: FloatArray, threshold: float
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Re-weigh or prune every column in turn, by rank-one updates of the posterior.

    Returns
    -------
    precisions : (K,) float
        1 / (omega^2 - rho), (77), of those that are kept.
    kept : (K,) bool
    ratios : (K,) float
        Activation ratio of each when its turn came.
    """
    covariance, amplitudes, precisions = fit.covariance, fit.amplitudes, precisions.copy()
    kept, ratios = np.ones(len(precisions), dtype=np.bool_), np.zeros(len(precisions))
    for index in range(len(precisions)):
        variance = covariance[index, index].real
        inverse_rho = 1.0 / variance - precisions[index]
        if inverse_rho > 0.0:
            power = amplitudes[index].real ** 2 + amplitudes[index].imag ** 2
            ratios[index] = power / (variance * variance * inverse_rho)
        column, amplitude = covariance[:, index].copy(), amplitudes[index]
        gain = 1.0 / variance
        kept[index] = ratios[index] > threshold
        if kept[index]:
            change = inverse_rho / (ratios[index] - 1.0) - precisions[index]
            precisions[index] += change
            gain = change / (1.0 + change * variance)
        for i in range(len(precisions)):
            scaled = gain * column[i]
            amplitudes[i] -= scaled * amplitude
            for j in range(len(precisions)):
                covariance[i, j] -= scaled * column[j].conjugate()
    return precisions, kept, ratios


@compiled
def revised_channel(
    products: ComplexArray,
    channel: Channel,
    noise_precision: float,
    thresholds: tuple[float, float],
    max_additions: int,
) -> tuple[Channel, FloatArray, BoolArray, FloatArray]:
    """Algorithm 4 on the channel of one ramp: add the best bins, then re-weigh or prune each.

    Parameters
    ----------
    products : (B, B + 1, M) complex
        Spectra of `product_rows`: of columns by their bin difference, and with the residual.
    channel : Channel
        The columns before.
    noise_precision : float
        lambda.
    thresholds : tuple of float
        Activation ratio above which a bin is added, and above which it is kept.
    max_additions : int
        Bins added to a burst at most.

    Returns
    -------
    channel : Channel
        The columns before and the A added ones, with their new precisions.
    added_ratios : (A,) float
    kept : (K + A,) bool
        Which of them stay.
    kept_ratios : (K + A,) float
    """
    channel, added_ratios, fit = with_best_bins(
        products, channel, noise_precision, thresholds[0], max_additions
    )
    precisions, kept, ratios = reweighed(fit, channel.precisions, thresholds[1])
    channel = Channel(channel.owners, channel.bins, precisions, channel.twiddle)
    return channel, added_ratios, kept, ratios
