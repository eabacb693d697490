"""Algorithm 4 on the channel of one ramp: active columns and their prior precisions."""

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.kernels.channel import Channel
from vsep.kernels.channel_bins import activate, all_candidates, best_candidate
from vsep.kernels.channel_products import gathered_products
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import split
from vsep.kernels.posterior import Posterior, factored_posterior, inverse_factor


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
    factor = inverse_factor(gram, channel.precisions, noise_precision)  # R of (62)
    for burst in range(count):
        first, known = burst * (count + 1), size
        rows = split(products[first : first + count + 1])
        # (23)-(24) of every bin of this burst, active columns of all bursts known
        candidates = all_candidates(
            rows, _first(room, size), projections, factor[0], noise_precision, max_additions
        )
        energy = products[first + burst, 0].real  # |u psi_k|^2, the same for all bins
        taken = _taken(_first(room, size), burst, products.shape[1])
        for _ in range(max_additions):
            best, ratio, inverse_rho = best_candidate(candidates, taken, energy, noise_precision)
            if not ratio > threshold:  # Algorithm 4: added if omega^2/rho > T
                break
            taken[best] = True
            precision = inverse_rho / (ratio - 1.0)  # gamma = 1/(omega^2 - rho), (77)
            pivot = inverse_rho + precision
            activate(candidates, (rows, burst, size), best, pivot, noise_precision)
            room.owners[size], room.bins[size], room.precisions[size] = burst, best, precision
            ratios[size] = ratio
            size += 1
        if size > known:
            # The next burst sees the columns added to this one.
            gram, projections = gathered_products(products, count, _first(room, size))
            factor = inverse_factor(gram, room.precisions[:size], noise_precision)
    fit = factored_posterior(gram, projections, factor, noise_precision)
    return _first(room, size), ratios, fit


@compiled
def reestimate_precisions(
    fit: Posterior, precisions: FloatArray, threshold: float
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Re-estimate or prune every column in turn, by rank-one updates of the posterior.

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
        inverse_rho = 1.0 / variance - precisions[index]  # (23) from C_kk: 1/C_kk = 1/rho + gamma
        if inverse_rho > 0.0:
            power = amplitudes[index].real ** 2 + amplitudes[index].imag ** 2
            # (24): omega/rho = beta_k / C_kk
            ratios[index] = power / (variance * variance * inverse_rho)
        amplitude = amplitudes[index]
        for i in range(size):
            column[i] = covariance[i, index]
        gain = 1.0 / variance  # pruning: gamma to infinity
        kept[index] = ratios[index] > threshold
        if kept[index]:
            # from gamma to 1/(omega^2 - rho), (77)
            change = inverse_rho / (ratios[index] - 1.0) - precisions[index]
            precisions[index] += change
            gain = change / (1.0 + change * variance)  # Sherman-Morrison
        for i in range(size):
            scaled = gain * column[i]
            amplitudes[i] -= scaled * amplitude  # (61) after the change
            for j in range(size):
                covariance[i, j] -= scaled * column[j].conjugate()  # (62) after the change
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
    """Algorithm 4 on the channel of one ramp: add the best bins, then re-estimate or prune each.

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
    precisions, kept, ratios = reestimate_precisions(fit, channel.precisions, thresholds[1])
    channel = Channel(channel.owners, channel.bins, precisions, channel.twiddle)
    return channel, added_ratios, kept, ratios
