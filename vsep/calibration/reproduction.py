"""Cross-validation of a response on bursts that it was not estimated from."""

from collections.abc import Sequence

import numpy as np

from vsep._typing import FloatArray
from vsep.calibration.burst_fit import refine_fit, start_fit
from vsep.calibration.burst_windows import BurstWindow
from vsep.calibration.response_estimate import grid_for
from vsep.signal.receiver_response import ReceiverResponse

STEPS = 10


def reproduction_errors(
    windows: Sequence[BurstWindow],
    response: ReceiverResponse,
    sample_rate_hz: float,
    *,
    free_slope: bool = False,
) -> FloatArray:
    """NMSE of every burst on every antenna, each fitted by itself.

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
            fit = refine_fit(single, samples, grid, fit, free_slope=free_slope, steps=STEPS)
            errors[index, antenna] = fit.errors[0]
    return errors
