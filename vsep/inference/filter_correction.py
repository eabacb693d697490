"""What the assumed anti-aliasing filter is wrong by, estimated from the bursts themselves.

One complex spline, shared by all bursts of a frame, is added to the assumed response. Its
coefficients are a third sparse source beside objects and channels: each has its own prior
precision, is activated by (23)-(24) and pruned as a channel component is. With the right filter
none is active, and the correction is exactly zero.

A correction and the channels of the bursts can explain the same thing. The model of a ramp is
therefore linearised at the present correction, and the channel weights are marginalised: with the
columns X of the channels, their posterior covariance C, and the columns A of the splines, the
coefficients see the Gram matrix ``A^H (1 - lambda X C X^H) A``.
"""

from typing import Final

import numpy as np

from vsep._arrays import ComplexArray, IntArray, from_db
from vsep.inference.channel import passive_ratios
from vsep.inference.interference import InterferenceWorkspace, RampWork
from vsep.inference.sbl import ActiveSet, activation_ratio, converged_precision
from vsep.inference.state import NO_CORRECTION, EventKind, FilterCorrection
from vsep.signal.corrected_filter import NUM_SPLINES, knots_hz, modified_splines
from vsep.signal.template import SignalModel

ADDITIONS: Final = 8  # splines per step at most
# The fit may follow a wrong filter closely: errors left over look like objects.
FURTHER_THRESHOLD: Final = 2.0
PRUNE_THRESHOLD: Final = 1.6
# Largest prior deviation of a coefficient, in peaks of the assumed response. Without a limit the
# spline grows and the channel weights shrink for ever: their product is all that the frame shows.
LARGEST_DEVIATION: Final = 0.5
UNSEEN: Final = 1e-9  # share of a spline's energy that the channels must leave for it to be seen


def update_correction(
    work: InterferenceWorkspace, residual: ComplexArray, noise_precision: float
) -> None:
    """Activate, weigh and prune the splines of the filter's correction; the bursts follow.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts; their templates and posteriors and the correction are changed in place.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.
    """
    if not np.isfinite(work.assumed.anti_aliasing_filter.cutoff_hz) or not work.ramps:
        return
    gram, projections = spline_model(work, residual, noise_precision)
    splines = work.correction.active_splines
    active = ActiveSet(
        gram[np.ix_(splines, splines)],
        projections[splines],
        work.correction.precisions,
        noise_precision,
    )
    least = _least_precision(work.assumed)
    splines, active = _add_splines(work, splines, active, (gram, projections), least)
    splines, active = _update_splines(work, splines, active, least)
    correction = NO_CORRECTION
    if _log_evidence(active) > _first_threshold(work):
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


def spline_model(
    work: InterferenceWorkspace, residual: ComplexArray, noise_precision: float
) -> tuple[ComplexArray, ComplexArray]:
    """Gram matrix and projections of the splines, with the channels marginalised.

    Parameters
    ----------
    work : InterferenceWorkspace
        The bursts, at whose present correction the model is linearised.
    residual : (P, N) complex
        Received signal minus the objects.
    noise_precision : float
        lambda.

    Returns
    -------
    gram : (NUM_SPLINES, NUM_SPLINES) complex
    projections : (NUM_SPLINES,) complex
        Of the residual with the present correction added back.
    """
    gram = np.zeros((NUM_SPLINES, NUM_SPLINES), dtype=np.complex128)
    projections = np.zeros(NUM_SPLINES, dtype=np.complex128)
    coefficients = work.correction.coefficients
    for p, ramp in work.ramps.items():
        atoms = work.grid.atoms(ramp.bins).T
        splines = spline_columns(ramp, atoms, work.assumed)
        channels = ramp.templates[ramp.owners].T * atoms
        crossed = channels.conj().T @ splines
        regression = noise_precision * (ramp.covariance @ crossed).conj().T
        own = splines.conj().T @ splines
        seen = own - regression @ crossed
        # What the channels explain to rounding cannot be told from them.
        diagonal = np.diagonal(seen).real
        lost = diagonal <= UNSEEN * np.diagonal(own).real
        seen[lost, lost] = 0.0
        gram += seen
        target = residual[p] + splines @ coefficients
        projections += splines.conj().T @ target - regression @ (channels.conj().T @ target)
    return gram, projections


def spline_columns(ramp: RampWork, atoms: ComplexArray, assumed: SignalModel) -> ComplexArray:
    """(N, NUM_SPLINES) derivatives of a ramp's bursts by the coefficients of the splines.

    Parameters
    ----------
    ramp : RampWork
        The bursts of a ramp.
    atoms : (N, K) complex
        Channel atoms of its columns.
    assumed : SignalModel
        Sampling and assumed filter.
    """
    n = np.arange(assumed.num_samples)
    rate = assumed.sample_rate_hz
    columns = np.zeros((assumed.num_samples, NUM_SPLINES), dtype=np.complex128)
    for index, chirp in enumerate(ramp.chirps):
        own = ramp.own(index)
        carrier = np.exp(2j * np.pi * (chirp.start_frequency * n + 0.5 * chirp.slope * n**2))
        envelopes = modified_splines(
            np.asarray((chirp.start_frequency + chirp.slope * n) * rate, dtype=np.float64),
            chirp.slope * rate**2,
            assumed.anti_aliasing_filter.cutoff_hz,
        )
        columns += (envelopes * (carrier * (atoms[:, own] @ ramp.amplitudes[own]))).T
    return columns


def _first_threshold(work: InterferenceWorkspace) -> float:
    first = work.schedule.first_threshold_db
    return work.threshold if first is None else float(from_db(first))


def _least_precision(assumed: SignalModel) -> float:
    assumed_filter = assumed.anti_aliasing_filter
    response = assumed_filter.response(knots_hz(assumed_filter.cutoff_hz))
    return float((LARGEST_DEVIATION * np.abs(response).max()) ** -2)


def _log_evidence(active: ActiveSet) -> float:
    """Gain in log evidence over no correction at all, nats."""
    return active.cost() + float(np.sum(np.log(active.precisions)))


def _add_splines(
    work: InterferenceWorkspace,
    splines: IntArray,
    active: ActiveSet,
    moments: tuple[ComplexArray, ComplexArray],
    least_precision: float,
) -> tuple[IntArray, ActiveSet]:
    """Activate the best passive splines; the first needs what a ramp's first component needs."""
    gram, projections = moments
    for _ in range(ADDITIONS):
        threshold = FURTHER_THRESHOLD if len(splines) else _first_threshold(work)
        ratio, inverse_rho = passive_ratios(
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
        active = active.inserted(
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
    """Re-weigh or prune every active spline."""
    active.refresh()
    index = 0
    while index < len(active):
        rho, omega_sq = active.flat_prior_moments(index)
        ratio = activation_ratio(rho, omega_sq)
        if ratio > PRUNE_THRESHOLD:
            active.set_precision(index, max(least_precision, converged_precision(rho, omega_sq)))
            index += 1
            continue
        active, splines = active.without(index), np.delete(splines, index)
        work.record(EventKind.FILTER_PRUNED, -1, ratio, PRUNE_THRESHOLD)
    active.refresh()
    return splines, active
