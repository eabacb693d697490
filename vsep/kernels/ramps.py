"""All interfered ramps in one call: posteriors, costs, slopes and channel selection.

A call of a kernel costs more than most kernels need for one ramp. The columns of all ramps
therefore stand in flat arrays, one ramp after the other, and the loops over the ramps are here.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray
from vsep.kernels.channel import (
    Channel,
    channel_cost,
    channel_slopes,
    columns_posterior,
    fill_bursts,
    ramp_columns,
)
from vsep.kernels.channel_products import fill_product_rows
from vsep.kernels.channel_selection import revised_channel
from vsep.kernels.compiler import compiled
from vsep.kernels.complex_parts import split_row


class FlatRamps(NamedTuple):
    """Bursts and channel columns of R ramps, one ramp after the other.

    Ramp r has the bursts ``first_burst[r]`` to ``first_burst[r + 1]`` of the templates (B, N), and
    the columns ``first_column[r]`` to ``first_column[r + 1]`` of the others: `owners` (K,) counts
    the bursts of the frame, `bins` and `precisions` (K,) are as in `Channel`, `twiddle` (M,) is
    shared.
    """

    templates: ComplexArray
    first_burst: IntArray
    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    first_column: IntArray
    twiddle: ComplexArray


class FlatPosterior(NamedTuple):
    """Posteriors of R ramps: covariances (sum of K^2,), their diagonals and the means (K,).

    ``traces`` is tr(A C A^H), ``log_determinants`` log|C| (R,), NaN where a precision matrix is not
    positive definite; ``signals`` (B, N) are the bursts U Psi beta.
    """

    covariances: ComplexArray
    variances: FloatArray
    amplitudes: ComplexArray
    traces: FloatArray
    log_determinants: FloatArray
    signals: ComplexArray


@compiled
def templates_of(ramps: FlatRamps, r: int) -> ComplexArray:
    """(B, N) templates of a ramp."""
    return ramps.templates[ramps.first_burst[r] : ramps.first_burst[r + 1]]


@compiled
def channel_of(ramps: FlatRamps, r: int) -> Channel:
    """Columns of a ramp; its bursts are counted from 0."""
    first, last = ramps.first_column[r], ramps.first_column[r + 1]
    owners = np.empty(last - first, dtype=np.int64)
    for k in range(last - first):
        owners[k] = ramps.owners[first + k] - ramps.first_burst[r]  # bursts counted within the ramp
    return Channel(
        owners,
        ramps.bins[first:last],
        ramps.precisions[first:last],
        ramps.twiddle,
    )


@compiled
def all_posteriors(
    ramps: FlatRamps, residual: ComplexArray, noise_precision: float
) -> FlatPosterior:
    """Weight posteriors (60)-(62) of all ramps at their residuals (R, N)."""
    num_ramps, squares = len(ramps.first_column) - 1, 0
    for r in range(num_ramps):
        squares += (ramps.first_column[r + 1] - ramps.first_column[r]) ** 2
    covariances = np.empty(squares, dtype=np.complex128)
    amplitudes = np.empty(len(ramps.bins), dtype=np.complex128)
    variances = np.empty(len(ramps.bins))
    traces, log_determinants = np.zeros(num_ramps), np.empty(num_ramps)
    signals = np.empty(ramps.templates.shape, dtype=np.complex128)
    place = 0
    for r in range(num_ramps):
        channel, first = channel_of(ramps, r), ramps.first_column[r]
        _, columns = ramp_columns(templates_of(ramps, r), channel)
        # C_beta from (62), beta from (61)
        fit = columns_posterior(
            columns, split_row(residual[r]), channel.precisions, noise_precision
        )
        log_determinants[r] = fit.log_determinant
        own = signals[ramps.first_burst[r] : ramps.first_burst[r + 1]]
        fill_bursts(columns, channel.owners, fit.amplitudes, own)  # U Psi beta
        for i in range(len(fit.amplitudes)):
            amplitudes[first + i] = fit.amplitudes[i]
            variances[first + i] = fit.covariance[i, i].real
            for j in range(len(fit.amplitudes)):
                covariance = fit.covariance[i, j]
                covariances[place] = covariance
                place += 1
                # tr(A C A^H), a term of (65)
                traces[r] += (fit.gram[i, j].conjugate() * covariance).real
    return FlatPosterior(covariances, variances, amplitudes, traces, log_determinants, signals)


@compiled
def all_signals(ramps: FlatRamps, amplitudes: ComplexArray) -> ComplexArray:
    """(B, N) bursts U Psi beta of all ramps."""
    signals = np.empty(ramps.templates.shape, dtype=np.complex128)
    for r in range(len(ramps.first_burst) - 1):
        channel = channel_of(ramps, r)
        _, columns = ramp_columns(templates_of(ramps, r), channel)
        own = signals[ramps.first_burst[r] : ramps.first_burst[r + 1]]
        weights = amplitudes[ramps.first_column[r] : ramps.first_column[r + 1]]
        fill_bursts(columns, channel.owners, weights, own)
    return signals


@compiled
def _with_trial(ramps: FlatRamps, r: int, moving: int, trial: ComplexArray) -> ComplexArray:
    """Templates of a ramp with another one in place of its moving burst's."""
    first = ramps.first_burst[r]
    templates = np.empty((ramps.first_burst[r + 1] - first, len(trial)), dtype=np.complex128)
    for b in range(len(templates)):
        for n in range(len(trial)):
            # U(theta + step)
            templates[b, n] = trial[n] if b == moving else ramps.templates[first + b, n]
    return templates


@compiled
def _trial_of(shared: int, chosen: IntArray) -> int:
    """Return which of the chosen bursts a ramp holds, -1 for none."""
    for trial in range(len(chosen)):
        if chosen[trial] == shared:
            return trial
    return -1


@compiled
def all_costs(
    ramps: FlatRamps,
    moving: IntArray,
    shared: IntArray,
    chosen: IntArray,
    trials: ComplexArray,
    residual: ComplexArray,
    noise_precision: float,
) -> FloatArray:
    """(T,) costs (71) with trial templates in place of moving ones.

    Parameters
    ----------
    ramps : FlatRamps
    moving : (R,) int
        Which burst of each ramp moves.
    shared : (R,) int
        Which of all bursts that move it is, -1 for none; costs of ramps that share one are summed.
    chosen : (T,) int
        Those whose costs are wanted.
    trials : (T, N) complex
        Their templates.
    residual : (R, N) complex
    noise_precision : float
        lambda.
    """
    costs = np.zeros(len(trials))
    for r in range(len(moving)):
        trial = _trial_of(shared[r], chosen)
        if trial >= 0:
            templates = _with_trial(ramps, r, moving[r], trials[trial])
            channel = channel_of(ramps, r)
            # (71); the antennas' log evidences add up
            costs[trial] += channel_cost(templates, residual[r], channel, noise_precision)
    return costs


@compiled
def all_slopes(
    ramps: FlatRamps,
    moving: IntArray,
    shared: IntArray,
    chosen: IntArray,
    trials: ComplexArray,
    derivatives: ComplexArray,
    residual: ComplexArray,
    noise_precision: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Costs (T,) as `all_costs`, gradients (T, 2) and curvatures (T, 2, 2).

    The derivatives (T, 2, N) of the trials are those by the two parameters.
    """
    costs, gradients = np.zeros(len(trials)), np.zeros((len(trials), 2))
    curvatures = np.zeros((len(trials), 2, 2))
    for r in range(len(moving)):
        trial = _trial_of(shared[r], chosen)
        if trial >= 0:
            cost, gradient, curvature = channel_slopes(
                _with_trial(ramps, r, moving[r], trials[trial]),
                moving[r],
                derivatives[trial],
                residual[r],
                channel_of(ramps, r),
                noise_precision,
            )
            costs[trial] += cost
            for i in range(2):
                gradients[trial, i] += gradient[i]  # the sum's gradient
                for j in range(2):
                    curvatures[trial, i, j] += curvature[i, j]  # and Fisher information
    return costs, gradients, curvatures


@compiled
def all_product_rows(ramps: FlatRamps, residual: ComplexArray, scale: float) -> ComplexArray:
    """(sum of B (B + 1), N) rows of `fill_product_rows` of all ramps."""
    size = 0
    for r in range(len(residual)):
        count = ramps.first_burst[r + 1] - ramps.first_burst[r]
        size += count * (count + 1)
    rows = np.empty((size, residual.shape[1]), dtype=np.complex128)
    place = 0
    for r in range(len(residual)):
        count = ramps.first_burst[r + 1] - ramps.first_burst[r]
        fill_product_rows(templates_of(ramps, r), residual[r], scale, rows[place:])
        place += count * (count + 1)
    return rows


class Revision(NamedTuple):
    """Columns of all ramps after Algorithm 4, those pruned among them.

    ``first_column`` (R + 1,), the others (K,): `added_ratios` are the activation ratios with which
    columns were added, zero for those that were there; `ratios` those when they were re-estimated.
    """

    first_column: IntArray
    owners: IntArray
    bins: IntArray
    precisions: FloatArray
    added_ratios: FloatArray
    kept: BoolArray
    ratios: FloatArray


@compiled
def all_revisions(
    products: ComplexArray,
    ramps: FlatRamps,
    noise_precision: float,
    thresholds: tuple[float, float],
    max_additions: int,
) -> Revision:
    """Algorithm 4 on all ramps, see `revised_channel`; products are the spectra of the rows."""
    num_ramps = len(ramps.first_burst) - 1
    most = len(ramps.bins) + len(ramps.templates) * max_additions
    first_column = np.zeros(num_ramps + 1, dtype=np.int64)
    owners, bins = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64)
    kept, precisions = np.empty(most, dtype=np.bool_), np.empty(most)
    added_ratios, ratios = np.zeros(most), np.empty(most)
    row = place = 0
    for r in range(num_ramps):
        count = ramps.first_burst[r + 1] - ramps.first_burst[r]
        before = channel_of(ramps, r)
        channel, new_ratios, stay, own_ratios = revised_channel(
            products[row:], count, before, noise_precision, thresholds, max_additions
        )
        row += count * (count + 1)  # products of this ramp
        for k in range(len(channel.bins)):
            owners[place], bins[place] = channel.owners[k] + ramps.first_burst[r], channel.bins[k]
            precisions[place], kept[place] = channel.precisions[k], stay[k]
            added_ratios[place], ratios[place] = new_ratios[k], own_ratios[k]
            place += 1
        first_column[r + 1] = place
    return Revision(
        first_column,
        owners[:place],
        bins[:place],
        precisions[:place],
        added_ratios[:place],
        kept[:place],
        ratios[:place],
    )
