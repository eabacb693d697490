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
from vsep.kernels.channel import Channel
from vsep.kernels.compiler import compiled
from vsep.kernels.posterior import Posterior, factored_posterior, inverse_factor
from vsep.kernels.split_arrays import Split, add_scaled, split

NOT_EXPLAINED = 1e-9  # of a column's own energy: what the others must leave of it


class Candidates(NamedTuple):
    """All bins of one burst: ``white`` (K, M) whitened correlations with K columns, `innovation`.

    ``innovation`` is (1, M); ``explained`` (M,) is the whitened correlations' squared length.
    """

    white: Split
    innovation: Split
    explained: FloatArray


@compiled
def fill_product_rows(
    templates: ComplexArray, residual: ComplexArray, scale: float, rows: ComplexArray
) -> None:
    """Write the (B (B + 1), N) rows whose spectra are the inner products of all possible columns.

    Row i (B + 1) + j is for columns of burst i with those of burst j, with the residual if j = B.
    """
    count, num_samples = templates.shape
    between = scale / np.sqrt(num_samples)
    for i in range(count):
        own, place = templates[i], i * (count + 1)
        for j in range(count):
            row, other = rows[place + j], templates[j]
            for n in range(num_samples):
                row[n] = between * (own[n].conjugate() * other[n])
        row = rows[place + count]
        for n in range(num_samples):
            row[n] = scale * (own[n].conjugate() * residual[n])


@compiled
def gathered_products(
    products: ComplexArray, count: int, channel: Channel
) -> tuple[ComplexArray, ComplexArray]:
    """Gram matrix and projections of the columns from the products of all possible ones."""
    owners, bins = channel.owners, channel.bins
    size, num_bins = len(bins), products.shape[1]
    gram = np.empty((size, size), dtype=np.complex128)
    projections = np.empty(size, dtype=np.complex128)
    for i in range(size):
        first = owners[i] * (count + 1)
        projections[i] = products[first + count, bins[i]]
        for j in range(size):
            lag = bins[i] - bins[j]
            lag = lag if lag >= 0 else lag + num_bins
            gram[i, j] = products[first + owners[j], lag]
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
    shape, last = (size + spare, num_bins), len(products.real) - 1
    candidates = Candidates(
        Split(np.zeros(shape), np.zeros(shape)),
        Split(np.zeros((1, num_bins)), np.zeros((1, num_bins))),
        np.zeros(num_bins),
    )
    add_scaled(complex(1.0, 0.0), products, last, candidates.innovation, 0)
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
def _longer(channel: Channel, spare: int) -> Channel:
    """Return the columns with room for more behind them."""
    size = len(channel.bins)
    owners, bins = np.empty(size + spare, np.int64), np.empty(size + spare, np.int64)
    precisions = np.empty(size + spare)
    for k in range(size):
        owners[k], bins[k] = channel.owners[k], channel.bins[k]
        precisions[k] = channel.precisions[k]
    return Channel(owners, bins, precisions, channel.twiddle)


@compiled
def _first(channel: Channel, size: int) -> Channel:
    """Return the first columns."""
    return Channel(
        channel.owners[:size], channel.bins[:size], channel.precisions[:size], channel.twiddle
    )


@compiled
def _taken(channel: Channel, burst: int, num_bins: int) -> BoolArray:
    """(M,) which bins of a burst are active."""
    taken = np.zeros(num_bins, dtype=np.bool_)
    for k in range(len(channel.bins)):
        if channel.owners[k] == burst:
            taken[channel.bins[k]] = True
    return taken


@compiled
def with_best_bins(
    products: ComplexArray,
    count: int,
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
    ratios : (K,) float
        Their activation ratios; zero for the columns that were there.
    fit : Posterior
        Of all columns.
    """
    size = len(channel.bins)
    room = _longer(channel, count * max_additions)
    ratios = np.zeros(len(room.bins))
    gram, projections = gathered_products(products, count, channel)
    factor = inverse_factor(gram, channel.precisions, noise_precision)
    for burst in range(count):
        first, known = burst * (count + 1), size
        rows = split(products[first : first + count + 1])
        candidates = all_candidates(
            rows, _first(room, size), projections, factor[0], noise_precision, max_additions
        )
        energy = products[first + burst, 0].real
        taken = _taken(_first(room, size), burst, products.shape[1])
        for _ in range(max_additions):
            best, ratio, inverse_rho = best_candidate(candidates, taken, energy, noise_precision)
            if not ratio > threshold:
                break
            taken[best] = True
            precision = inverse_rho / (ratio - 1.0)
            pivot = inverse_rho + precision
            _activate(candidates, (rows, burst, size), best, pivot, noise_precision)
            room.owners[size], room.bins[size], room.precisions[size] = burst, best, precision
            ratios[size] = ratio
            size += 1
        if size > known:
            gram, projections = gathered_products(products, count, _first(room, size))
            factor = inverse_factor(gram, room.precisions[:size], noise_precision)
    fit = factored_posterior(gram, projections, factor, noise_precision)
    return _first(room, size), ratios, fit


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
    covariance, amplitudes, size = fit.covariance, fit.amplitudes, len(precisions)
    precisions, column = precisions.copy(), np.empty(size, dtype=np.complex128)
    kept, ratios = np.ones(size, dtype=np.bool_), np.zeros(size)
    for index in range(size):
        variance = covariance[index, index].real
        inverse_rho = 1.0 / variance - precisions[index]
        if inverse_rho > 0.0:
            power = amplitudes[index].real ** 2 + amplitudes[index].imag ** 2
            ratios[index] = power / (variance * variance * inverse_rho)
        amplitude = amplitudes[index]
        for i in range(size):
            column[i] = covariance[i, index]
        gain = 1.0 / variance
        kept[index] = ratios[index] > threshold
        if kept[index]:
            change = inverse_rho / (ratios[index] - 1.0) - precisions[index]
            precisions[index] += change
            gain = change / (1.0 + change * variance)
        for i in range(size):
            scaled = gain * column[i]
            amplitudes[i] -= scaled * amplitude
            for j in range(size):
                covariance[i, j] -= scaled * column[j].conjugate()
    return precisions, kept, ratios


@compiled
def revised_channel(
    products: ComplexArray,
    count: int,
    channel: Channel,
    noise_precision: float,
    thresholds: tuple[float, float],
    max_additions: int,
) -> tuple[Channel, FloatArray, BoolArray, FloatArray]:
    """Algorithm 4 on the channel of one ramp: add the best bins, then re-weigh or prune each.

    Parameters
    ----------
    products : (B (B + 1), M) complex
        Spectra of `fill_product_rows`: of columns by their bin difference, and with the residual.
    count : int
        B.
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
    added_ratios : (K + A,) float
        Zero for the columns before.
    kept : (K + A,) bool
        Which of them stay.
    kept_ratios : (K + A,) float
    """
    channel, added_ratios, fit = with_best_bins(
        products, count, channel, noise_precision, thresholds[0], max_additions
    )
    precisions, kept, ratios = reweighed(fit, channel.precisions, thresholds[1])
    channel = Channel(channel.owners, channel.bins, precisions, channel.twiddle)
    return channel, added_ratios, kept, ratios
