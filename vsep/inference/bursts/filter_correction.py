"""Estimation of the anti-aliasing filter's error from the bursts themselves.

One complex spline, shared by all bursts of a frame, is added to the assumed response. Its
coefficients are a third sparse source beside objects and channels: each has its own prior
precision, is activated by (23)-(24) and pruned as a channel component is. With the right filter
none is active, and the correction is exactly zero.

A correction and the channels of the bursts can explain the same thing. The model of a ramp is
therefore linearised at the present correction, and the channel weights are marginalised: with the
columns X of the channels, their posterior covariance C, and the columns A of the splines, the
coefficients see the Gram matrix ``A^H (1 - lambda X C X^H) A``.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.inference.bursts.channel import ChannelGrid, passive_ratios
from vsep.inference.bursts.table import RampBursts
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.progress import EventKind
from vsep.inference.core.state import NO_CORRECTION, FilterCorrection
from vsep.inference.objects.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.kernels.fresnel import SMOOTH
from vsep.kernels.spline_ratios import SplineGrid, first_ratios
from vsep.signal.corrected_filter import NUM_SPLINES, REACH, knots_hz, modified_splines
from vsep.signal.template import SignalModel
from vsep.units import from_db

ADDITIONS: Final = 8  # splines per step at most
# The fit may follow a wrong filter closely: errors left over look like objects.
FURTHER_THRESHOLD: Final = 2.0
PRUNE_THRESHOLD: Final = 1.6
# Largest prior deviation of a coefficient, in peaks of the assumed response. Without a limit the
# spline grows and the channel weights shrink for ever: their product is all that the frame shows.
MAX_DEVIATION: Final = 0.5
KERNEL_WIDTHS: Final = 4.0  # beyond the splines' band, in which their responses fall
UNSEEN: Final = 1e-9  # share of a spline's energy that the channels must leave for it to be seen


def update_correction(
    work: InterferenceWorkspace,
    residual: ComplexArray,
    noise_precision: float,
    *,
    early: bool = False,
) -> None:
    """Activate, estimate and prune the splines of the filter's correction; the bursts follow.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts; their templates and posteriors and the correction are changed in place.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.
    early : bool
        Whether a first spline needs as much evidence as a first component in every ramp.
    """
    if not np.isfinite(work.assumed.anti_aliasing_filter.cutoff_hz) or len(work.table) == 0:
        return
    if work.crowded:  # a burst that is not modelled yet would bend the filter
        return
    first = _first_threshold(work) * (len(work.table.interfered) if early else 1)
    if work.correction.num_splines == 0:
        # One evaluation tells whether any spline can become active at all.
        ratios = passive_spline_ratios(work, residual, noise_precision)
        if ratios.max() <= first:
            return
    # A^H (I - lambda X C X^H) A and its projections
    gram, projections = SplineModel(work, residual, noise_precision).moments()
    splines = work.correction.active_splines
    active = ActiveSet(
        gram[np.ix_(splines, splines)],
        projections[splines],
        work.correction.precisions,
        noise_precision,
    )
    least = _least_precision(work.assumed)
    # Algorithm 4: add
    moments = gram, projections
    splines, active = _add_splines(work, splines, active, moments, (first, least))
    splines, active = _update_splines(work, splines, active, least)  # Algorithm 4: update, prune
    correction = NO_CORRECTION
    # the whole correction must gain as much as a first component
    if _log_evidence(active) > first:
        correction = FilterCorrection(
            active_splines=splines,
            amplitudes=active.amplitudes,
            covariance=active.covariance,
            precisions=active.precisions,
            trace=active.trace(),
        )
    if correction.num_splines or work.correction.num_splines:
        work.correct(correction)
        work.recompute(residual, noise_precision)


def passive_spline_ratios(
    work: InterferenceWorkspace, residual: ComplexArray, noise_precision: float
) -> FloatArray:
    """(NUM_SPLINES,) activation ratios while no spline is active.

    The residual without the channels' estimate is then all that the splines can explain.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts, one at least, without a correction.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.
    """
    table = work.table
    noise_residual = (residual - work.signal)[table.interfered]  # r_beta - U Psi beta
    knots = knots_hz(work.assumed.anti_aliasing_filter.cutoff_hz) / work.assumed.sample_rate_hz
    return first_ratios(
        work.flat(),
        (table.chirps.start_frequency, table.chirps.slope),
        (table.covariances, table.amplitudes),
        noise_residual,
        noise_precision,
        SplineGrid(knots, SMOOTH),
        UNSEEN,
    )


class SplineModel:
    """The splines of all interfered ramps, with the channels marginalised.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts, at whose present correction the model is linearised.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.

    Attributes
    ----------
    columns : (M, NUM_SPLINES) complex
        Derivatives of the ramps by the coefficients, one ramp after the other, at the samples that
        a spline can reach.
    crossed : list of (K, NUM_SPLINES) complex
        Inner products of the channel columns of each ramp with those.
    energies : (R, NUM_SPLINES) float
        What the channels leave of the energy of each column.
    """

    def __init__(
        self, work: InterferenceWorkspace, residual: ComplexArray, noise_precision: float
    ) -> None:
        ramps = list(work.ramps.values())
        reached = reached_samples(ramps, work.assumed)
        self.residual = np.concatenate(
            [residual[ramp.ramp, some] for ramp, some in zip(ramps, reached, strict=True)]
        )
        self.noise_precision = noise_precision
        self.coefficients = work.correction.coefficients
        own = spline_columns(ramps, work.grid, work.assumed)  # A
        self.columns = np.concatenate(own)
        self.bounds = np.cumsum([0, *map(len, own)]).tolist()
        self.channels = [  # X^H
            (ramp.templates[ramp.owners, some] * work.grid.atoms(ramp.bins)[:, some]).conj()
            for ramp, some in zip(ramps, reached, strict=True)
        ]
        # X^H A
        self.crossed = [each @ own for each, own in zip(self.channels, own, strict=True)]
        self.regressions = [  # lambda C X^H A
            noise_precision * (ramp.covariance @ crossed)
            for ramp, crossed in zip(ramps, self.crossed, strict=True)
        ]
        explained = [
            np.einsum("ks,ks->s", crossed.conj(), regression).real
            for crossed, regression in zip(self.crossed, self.regressions, strict=True)
        ]
        # Squares of real and imaginary parts: a conjugate of all columns costs more than the sum.
        squares = [np.einsum("np,np->p", *2 * [each.view(np.float64)]) for each in own]
        energies = np.array(squares).reshape(-1, NUM_SPLINES, 2).sum(axis=2)
        seen = energies - np.array(explained)
        # What the channels explain to rounding cannot be told from them.
        self.energies: FloatArray = np.where(seen <= UNSEEN * energies, 0.0, seen)

    def moments(self) -> tuple[ComplexArray, ComplexArray]:
        """Gram matrix (NUM_SPLINES, NUM_SPLINES) and projections (NUM_SPLINES,) of the splines.

        The projections are those of the residual with the present correction added back.
        """
        # residual of the assumed filter
        target = self.residual + self.columns @ self.coefficients
        adjoint = self.columns.conj().T
        gram, projections = adjoint @ self.columns, adjoint @ target
        for channel, crossed, regression, first, last in zip(
            self.channels,
            self.crossed,
            self.regressions,
            self.bounds[:-1],
            self.bounds[1:],
            strict=True,
        ):
            gram -= regression.conj().T @ crossed  # channels marginalised
            projections -= regression.conj().T @ (channel @ target[first:last])  # likewise
        np.fill_diagonal(gram, self.energies.sum(axis=0))
        return gram, projections


def reached_samples(ramps: Sequence[RampBursts], assumed: SignalModel) -> list[slice]:
    """Return the samples of each ramp that a spline can reach; all where G is a closed form.

    Beyond the splines' band their responses fall within a few widths sqrt|Delta k| of the kernel.
    """
    anti_aliasing_filter = assumed.anti_aliasing_filter
    if anti_aliasing_filter.smooth is None:
        return [slice(0, assumed.num_samples)] * len(ramps)
    signed = np.concatenate([ramp.chirps.slope for ramp in ramps])
    slope = np.abs(signed)
    half_band = REACH * anti_aliasing_filter.cutoff_hz / assumed.sample_rate_hz
    reach = (half_band + KERNEL_WIDTHS * np.sqrt(slope)) / slope
    centres = -np.concatenate([ramp.chirps.start_frequency for ramp in ramps]) / signed
    begins = np.cumsum([0, *(len(ramp.chirps) for ramp in ramps[:-1])])
    lowest = np.minimum.reduceat(centres - reach, begins)
    highest = np.maximum.reduceat(centres + reach, begins)
    first = np.clip(lowest, 0, assumed.num_samples - 1).astype(np.int64)
    last = np.clip(highest, first + 1, assumed.num_samples).astype(np.int64)
    return [slice(*each) for each in zip(first.tolist(), last.tolist(), strict=True)]


def spline_columns(
    ramps: Sequence[RampBursts], grid: ChannelGrid, assumed: SignalModel
) -> list[ComplexArray]:
    """(M, NUM_SPLINES) derivatives of the bursts of each ramp by the splines' coefficients.

    Parameters
    ----------
    ramps : sequence of RampBursts
        The bursts and their channels; a ramp's M samples are `reached_samples`.
    grid : ChannelGrid
        The channel grid.
    assumed : SignalModel
        Sampling and assumed filter.
    """
    rate = assumed.sample_rate_hz
    reached = reached_samples(ramps, assumed)
    counts = [len(ramp.chirps) for ramp in ramps]
    lengths = np.repeat([some.stop - some.start for some in reached], counts)
    n = np.concatenate(
        [
            np.arange(some.start, some.stop)
            for some, count in zip(reached, counts, strict=True)
            for _ in range(count)
        ]
    )
    start, slope = (
        np.repeat(np.concatenate([getattr(ramp.chirps, name) for ramp in ramps]), lengths)
        for name in ("start_frequency", "slope")
    )
    channels = np.concatenate(
        [
            line[some]
            for ramp, some in zip(ramps, reached, strict=True)
            for line in _channel_lines(ramp, grid)
        ]
    )
    course_hz: FloatArray = np.asarray((start + slope * n) * rate, dtype=np.float64)
    cutoff_hz = assumed.anti_aliasing_filter.cutoff_hz
    # what a chirp makes of every spline along its course
    envelopes = modified_splines(course_hz, slope * rate**2, cutoff_hz)
    envelopes *= (np.exp(2j * np.pi * (start * n + 0.5 * slope * n**2)) * channels)[:, None]
    bursts = np.split(envelopes, np.cumsum(lengths)[:-1])
    # Bursts of one ramp add up.
    return [
        sum(bursts[last - count + 1 : last], bursts[last - count])
        for last, count in zip(np.cumsum(counts).tolist(), counts, strict=True)
    ]


def _channel_lines(ramp: RampBursts, grid: ChannelGrid) -> list[ComplexArray]:
    """(N,) Psi beta of every burst of a ramp."""
    if len(ramp.chirps) == 1:
        return [ramp.amplitudes @ grid.atoms(ramp.bins)]
    owned = [ramp.own(index) for index in range(len(ramp.chirps))]
    return [ramp.amplitudes[own] @ grid.atoms(ramp.bins[own]) for own in owned]


def _first_threshold(work: InterferenceWorkspace) -> float:
    first = work.schedule.first_threshold_db
    return work.threshold if first is None else float(from_db(first))


def _least_precision(assumed: SignalModel) -> float:
    assumed_filter = assumed.anti_aliasing_filter
    response = assumed_filter.response(knots_hz(assumed_filter.cutoff_hz))
    return float((MAX_DEVIATION * np.abs(response).max()) ** -2)


def _log_evidence(active: ActiveSet) -> float:
    """Gain in log evidence over no correction at all, nats."""
    return active.cost() + float(np.sum(np.log(active.precisions)))


def _add_splines(
    work: InterferenceWorkspace,
    splines: IntArray,
    active: ActiveSet,
    moments: tuple[ComplexArray, ComplexArray],
    limits: tuple[float, float],
) -> tuple[IntArray, ActiveSet]:
    """Activate the best passive splines; the limits are what a first one needs, and the precision.

    A first one needs what a ramp's first component needs, at least.
    """
    gram, projections = moments
    first_threshold, least_precision = limits
    for _ in range(ADDITIONS):
        threshold = FURTHER_THRESHOLD if len(splines) else first_threshold
        ratio, inverse_rho = passive_ratios(  # (23)-(24)
            gram[splines],
            projections,
            np.diagonal(gram).real,
            active.covariance,
            active.amplitudes,
            active.noise_precision,
        )
        ratio[splines] = 0.0
        best = int(np.argmax(ratio))
        if ratio[best] <= threshold:
            break
        rho = 1.0 / float(inverse_rho[best])
        active = active.inserted(  # block inversion (68)
            len(active),
            gram[splines, best],
            complex(projections[best]),
            float(gram[best, best].real),
            max(least_precision, converged_precision(rho, float(ratio[best]) * rho)),
        )
        splines = np.append(splines, best)
        work.record(EventKind.FILTER_ADDED, -1, float(ratio[best]), threshold)
    return splines, active


def _update_splines(
    work: InterferenceWorkspace, splines: IntArray, active: ActiveSet, least_precision: float
) -> tuple[IntArray, ActiveSet]:
    """Re-estimate or prune every active spline."""
    active.refresh()
    index = 0
    while index < len(active):
        rho, omega_sq = active.flat_prior_moments(index)  # (23)-(24)
        ratio = activation_ratio(rho, omega_sq)
        if ratio > PRUNE_THRESHOLD:  # kept, gamma from (77), no smaller than allowed
            active.set_precision(index, max(least_precision, converged_precision(rho, omega_sq)))
            index += 1
            continue
        active, splines = active.without(index), np.delete(splines, index)
        work.record(EventKind.FILTER_PRUNED, -1, ratio, PRUNE_THRESHOLD)
    active.refresh()
    return splines, active
