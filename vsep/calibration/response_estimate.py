"""Estimation of a receiver's complex response as the common part of many bursts.

Every burst is a sweep through the response. With the crossing times, slopes and gains of all bursts
given, the response is a linear least-squares problem on the lines of `LineGrid`; with the response
given, every burst is fitted by itself. The two alternate. Slopes may differ a little from burst to
burst (oscillators are not perfect); their median is held at the given slope difference, without
which the response could take up any quadratic phase.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve, toeplitz

from vsep._typing import ComplexArray, FloatArray
from vsep.calibration.burst_fit import BurstFit, evaluate, reference, refine_fit, start_fit
from vsep.calibration.burst_windows import BurstWindow
from vsep.calibration.line_grid import LineGrid
from vsep.errors import InputError
from vsep.signal.receiver_response import ReceiverResponse

MIN_BURSTS = 8
ROUNDS = 8
STEPS = 3  # of every burst's fit in a round
SINGLE_STEPS = 10  # of the fit of a burst to a response estimated from others
FREE_SLOPES_FROM = 3  # round (from 0) from which on slopes are free
TRUSTED_ERROR = 0.3  # NMSE of a burst at most, to count in a round after the first two
# Of the lines' own energy: lines that no burst reaches stay near zero.
RIDGE = 1e-3


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ResponseEstimate:
    """A response and what it makes of the bursts that it comes from."""

    response: ReceiverResponse  #: of every antenna
    fits: tuple[BurstFit, ...]  #: one for every window


def grid_for(windows: Sequence[BurstWindow], sample_rate_hz: float) -> LineGrid:
    """Lines close enough for the longest window, a quarter of the grid to spare."""
    longest = max(window.signals.shape[1] for window in windows)
    size = 2 ** int(np.ceil(np.log2(1.25 * longest)))
    return LineGrid(size=size, sample_rate_hz=sample_rate_hz)


def estimate_response(
    windows: Sequence[BurstWindow], sample_rate_hz: float, slope_hz_per_s: float
) -> ResponseEstimate:
    """Estimate the response from bursts.

    `windows`: all of the same number of antennas; of one recording or several; `sample_rate_hz`:
    f_s; `slope_hz_per_s`: slope difference Delta k, interferer less victim, in the paper's sign.
    Raises `InputError` if there are too few bursts, or they have no common part.
    """
    if len(windows) < MIN_BURSTS:
        raise InputError(
            f"{len(windows)} bursts stand clear of each other and of the ramps' edges; at least "
            f"{MIN_BURSTS} are needed for a response."
        )
    grid = grid_for(windows, sample_rate_hz)
    response = _flat_response(grid, len(windows[0].signals))
    fits = [start_fit(window, response, grid, slope_hz_per_s) for window in windows]
    for round_number in range(ROUNDS):
        free_slope = round_number >= FREE_SLOPES_FROM
        fits = [
            refine_fit(window, response, grid, fit, free_slope=free_slope, steps=STEPS)
            for window, fit in zip(windows, fits, strict=True)
        ]
        fits = _at_slope(fits, slope_hz_per_s)
        trusted = [round_number < 2 or fit.errors.mean() < TRUSTED_ERROR for fit in fits]
        if sum(trusted) < MIN_BURSTS:
            raise InputError(
                f"Only {sum(trusted)} of {len(windows)} bursts share one response at a slope "
                f"difference of {slope_hz_per_s:g} Hz/s; at least {MIN_BURSTS} must: check it."
            )
        used = [
            pair
            for pair, good in zip(zip(windows, fits, strict=True), trusted, strict=True)
            if good
        ]
        response, later = _normalised(_least_squares(used, grid), grid)
        fits = [replace(fit, crossing=fit.crossing + later) for fit in fits]
    fits = [
        refine_fit(
            window,
            response,
            grid,
            evaluate(window, response, grid, fit.crossing, fit.slope_hz_per_s),
            free_slope=True,
            steps=STEPS,
        )
        for window, fit in zip(windows, fits, strict=True)
    ]
    used = [
        pair for pair, good in zip(zip(windows, fits, strict=True), trusted, strict=True) if good
    ]
    return ResponseEstimate(
        response=ReceiverResponse(
            frequency_hz=grid.frequency_hz,
            response=response,
            coherence=_coherence(used, grid),
            slope_difference_hz_per_s=slope_hz_per_s,
            num_bursts=len(used),
        ),
        fits=tuple(fits),
    )


def reproduction_errors(
    windows: Sequence[BurstWindow],
    response: ReceiverResponse,
    sample_rate_hz: float,
    *,
    free_slope: bool = False,
) -> FloatArray:
    """NMSE of every burst on every antenna, each fitted by itself to a response: cross-validation.

    Parameters
    ----------
    windows : sequence of BurstWindow
        Bursts.
    response : ReceiverResponse
        As measured elsewhere.
    sample_rate_hz : float
        f_s.
    free_slope : bool
        Whether a burst has three free parameters, gain, delay and slope, in place of two.

    Returns
    -------
    (B, A) float
        Residual energy over the energy of the window.
    """
    grid = grid_for(windows, sample_rate_hz)
    slope = response.slope_difference_hz_per_s
    errors = np.empty((len(windows), response.num_antennas))
    for antenna in range(response.num_antennas):
        samples = response.filter_of(antenna).response(grid.frequency_hz)[None]
        for index, window in enumerate(windows):
            single = window.of_antenna(antenna)
            fit = start_fit(single, samples, grid, slope)
            fit = refine_fit(single, samples, grid, fit, free_slope=free_slope, steps=SINGLE_STEPS)
            errors[index, antenna] = fit.errors[0]
    return errors


def _flat_response(grid: LineGrid, num_antennas: int) -> ComplexArray:
    """Start: one up to 0.4 sample rates, from there a straight fall to zero at 0.6."""
    share = np.abs(grid.frequency_hz) / grid.sample_rate_hz
    flat = np.clip((0.6 - share) / 0.2, 0.0, 1.0)
    return np.repeat(flat[None].astype(np.complex128), num_antennas, axis=0)


def _at_slope(fits: Sequence[BurstFit], slope_hz_per_s: float) -> list[BurstFit]:
    """Shift all slopes so that their median is the given one."""
    shift = slope_hz_per_s - float(np.median([fit.slope_hz_per_s for fit in fits]))
    return [replace(fit, slope_hz_per_s=fit.slope_hz_per_s + shift) for fit in fits]


def _least_squares(used: Sequence[tuple[BurstWindow, BurstFit]], grid: LineGrid) -> ComplexArray:
    """Response (A, K) that minimises the squared errors of all bursts."""
    num_lines = len(grid.lines)
    num_antennas = len(used[0][1].gains)
    normal = np.zeros((num_antennas, num_lines, num_lines), dtype=np.complex128)
    right = np.zeros((num_antennas, num_lines), dtype=np.complex128)
    for window, fit in used:
        zero = reference(window)
        chirp = grid.chirp(fit.crossing - zero, fit.slope_hz_per_s)
        differences = grid.gram(window.first - zero, window.signals.shape[1])
        columns = toeplitz(differences[num_lines - 1 :], differences[num_lines - 1 :: -1])
        columns = chirp.conj()[:, None] * columns * chirp
        # Every burst counts alike, whatever its level: the errors are relative.
        level = np.sum(np.abs(window.signals) ** 2, axis=1)
        normal += (np.abs(fit.gains) ** 2 / level)[:, None, None] * columns
        products = grid.project(window.signals, window.first - zero)
        right += (fit.gains.conj() / level)[:, None] * chirp.conj() * products
    response = np.empty((num_antennas, num_lines), dtype=np.complex128)
    for antenna in range(num_antennas):
        ridge = RIDGE * float(np.mean(np.diagonal(normal[antenna]).real))
        factor = cho_factor(normal[antenna] + ridge * np.eye(num_lines))
        response[antenna] = cho_solve(factor, right[antenna])
    return response


def _normalised(response: ComplexArray, grid: LineGrid) -> tuple[ComplexArray, float]:
    """No delay on average, a peak of one; and by how many samples the bursts cross later."""
    phase_step = float(np.angle(np.sum(response[:, 1:] * response[:, :-1].conj())))
    undelayed = response * np.exp(-1j * phase_step * grid.lines)
    peak = np.max(np.abs(undelayed), axis=1, keepdims=True)
    return np.asarray(undelayed / peak), -phase_step * grid.size / (2.0 * np.pi)


def _coherence(used: Sequence[tuple[BurstWindow, BurstFit]], grid: LineGrid) -> FloatArray:
    """Squared mean over mean square of the demodulated bursts, (A, K).

    Aliases change phase with the fraction of a sample at which a burst crosses, and lower it.
    """
    demodulated = []
    for window, fit in used:
        zero = reference(window)
        chirp = grid.chirp(fit.crossing - zero, fit.slope_hz_per_s)
        products = grid.project(window.signals, window.first - zero)
        demodulated.append(chirp.conj() * products / fit.gains[:, None])
    stacked = np.array(demodulated)
    power = np.mean(np.abs(stacked) ** 2, axis=0)
    common = np.abs(np.mean(stacked, axis=0)) ** 2
    return np.asarray(np.minimum(common / np.where(power > 0.0, power, 1.0), 1.0))
