"""Algorithm 4 on the channel of one ramp: which columns are active, and their prior precisions.

Everything is expressed by inner products of columns, which FFTs give for all possible ones at once.
"""

import numpy as np

from vsep._arrays import BoolArray, ComplexArray, FloatArray
from vsep.kernels.channel import Channel, Posterior, weight_posterior
from vsep.kernels.compiler import compiled

NOT_EXPLAINED = 1e-9  # of a column's own energy: what the others must leave of it


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
def best_passive(
    products: ComplexArray, burst: int, channel: Channel, fit: Posterior, noise_precision: float
) -> tuple[int, float, float]:
    """Bin of a burst with the largest activation ratio (23)-(24) among those not active.

    Returns
    -------
    best : int
    ratio, inverse_rho : float
        Its omega^2/rho and 1/rho.
    """
    owners, bins = channel.owners, channel.bins
    size, count, num_bins = len(bins), len(products), products.shape[2]
    energy = products[burst, burst, 0].real
    correlations = np.empty(size, dtype=np.complex128)
    best, best_ratio, best_inverse_rho = 0, 0.0, noise_precision * energy
    for candidate in range(num_bins):
        innovation = products[burst, count, candidate]
        active = False
        for k in range(size):
            lag = bins[k] - candidate
            active = active or (lag == 0 and owners[k] == burst)
            lag = lag if lag >= 0 else lag + num_bins
            correlations[k] = products[owners[k], burst, lag]
            innovation -= correlations[k].conjugate() * fit.amplitudes[k]
        explained = 0.0
        for i in range(size):
            weighted = 0.5 * fit.covariance[i, i].real * correlations[i]
            for j in range(i):
                weighted += fit.covariance[i, j] * correlations[j]
            explained += 2.0 * (correlations[i].conjugate() * weighted).real
        inverse_rho = noise_precision * energy - noise_precision**2 * explained
        if active or inverse_rho <= NOT_EXPLAINED * noise_precision * energy:
            continue
        power = noise_precision**2 * (innovation.real**2 + innovation.imag**2)
        if power > best_ratio * inverse_rho:
            best, best_ratio, best_inverse_rho = candidate, power / inverse_rho, inverse_rho
    return best, best_ratio, best_inverse_rho


@compiled
def gathered_posterior(
    products: ComplexArray, channel: Channel, noise_precision: float
) -> Posterior:
    """Posterior of the columns of a ramp from the products of all possible ones."""
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
    return weight_posterior(gram, projections, channel.precisions, noise_precision)


@compiled
def with_best_bins(
    products: ComplexArray,
    channel: Channel,
    noise_precision: float,
    threshold: float,
    max_additions: int,
) -> tuple[Channel, FloatArray]:
    """Add to every burst up to some of its best bins whose activation ratio exceeds a threshold.

    Returns
    -------
    channel : Channel
        The added columns stand last.
    ratios : (A,) float
        Their activation ratios.
    """
    ratios = np.empty(0)
    fit = gathered_posterior(products, channel, noise_precision)
    for burst in range(len(products)):
        for _ in range(max_additions):
            best, ratio, inverse_rho = best_passive(products, burst, channel, fit, noise_precision)
            if not ratio > threshold:
                break
            ratios = np.append(ratios, ratio)
            channel = Channel(
                np.append(channel.owners, np.int64(burst)),
                np.append(channel.bins, np.int64(best)),
                np.append(channel.precisions, inverse_rho / (ratio - 1.0)),
                channel.twiddle,
            )
            fit = gathered_posterior(products, channel, noise_precision)
    return channel, ratios


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
            amplitudes[i] -= gain * amplitude * column[i]
            for j in range(len(precisions)):
                covariance[i, j] -= gain * column[i] * column[j].conjugate()
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
    channel, added_ratios = with_best_bins(
        products, channel, noise_precision, thresholds[0], max_additions
    )
    fit = gathered_posterior(products, channel, noise_precision)
    precisions, kept, ratios = reweighed(fit, channel.precisions, thresholds[1])
    channel = Channel(channel.owners, channel.bins, precisions, channel.twiddle)
    return channel, added_ratios, kept, ratios
