r"""Evidence of a group in the cells of a residual, and how often noise alone reaches it.

A cell of a window holds a line with probability pi, whose weight is complex normal with the power
s of the noise (Bernoulli, Gauss). With x, the power of a cell over that of the noise, summed over
A antennas, the window's log evidence for a group against noise is the sum over its cells of

    l(x) = log(1 - pi + pi (1 + s)^-A exp(x s / (1 + s))) .

In white noise the x of cells that are whole cells apart are independent, with a Gamma law of
shape A: the law of the sum is a power of the characteristic function of l. A window that slides by
one cell exceeds u for the first time where the sum with its new cell does and that with the old
cell did not; the expected number of these crossings is the false-alarm rate.
"""

from functools import lru_cache

import numpy as np
from scipy import fft
from scipy.special import gammaincc, gammainccinv

from vsep._typing import FloatArray

LINE_SNR = 6.0  # s: lines a little below the threshold of single ones
USUAL_LINES = 4.0  # in a window
LIKELY = (0.1, 0.5)  # pi at least and at most
STEP = 0.005  # nats, of the lattice of the law
UNREACHED = 1e-24  # probability of a power x that noise has in no frame


def line_probability(num_cells: int) -> float:
    """Probability pi that a cell of a window holds a line."""
    return float(np.clip(USUAL_LINES / num_cells, *LIKELY))


def cell_evidence(powers: FloatArray, num_cells: int, num_antennas: int = 1) -> FloatArray:
    """Log evidence l(x) of cells in a window of so many.

    Examples
    --------
    >>> import numpy as np
    >>> np.round(cell_evidence(np.array([0.0, 4.0, 12.0]), 10), 2)
    array([-0.42,  0.86,  7.42])
    """
    likely = line_probability(num_cells)
    line = np.log(likely) - num_antennas * np.log1p(LINE_SNR) + powers * LINE_SNR / (1.0 + LINE_SNR)
    return np.asarray(np.logaddexp(np.log1p(-likely), line))


@lru_cache(maxsize=32)
def _tails(num_cells: int, num_antennas: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values u of the sum, how often a window exceeds them, and how often a shifted one begins to.

    Values on the lattice are rounded up: the rates are never too low.
    """
    most = float(gammainccinv(num_antennas, UNREACHED))
    lowest, highest = cell_evidence(np.array([0.0, most]), num_cells, num_antennas)
    ends = lowest + STEP * np.arange(int((highest - lowest) / STEP) + 1)
    # Powers x with l(x) at the ends of the lattice's steps
    likely = line_probability(num_cells)
    lines = np.log(np.exp(ends[1:]) - (1.0 - likely)) - np.log(likely)
    powers = (lines + num_antennas * np.log1p(LINE_SNR)) * (1.0 + LINE_SNR) / LINE_SNR
    exceeded = gammaincc(num_antennas, np.append(0.0, powers))
    size = fft.next_fast_len(len(ends) * num_cells)
    law = np.zeros(size)
    law[1 : len(ends)] = exceeded[:-1] - exceeded[1:]
    below = np.minimum(np.cumsum(law), 1.0)
    spectrum = fft.rfft(law)
    whole = np.maximum(fft.irfft(spectrum**num_cells, size), 0.0)
    # The old cell stays below and the new one exceeds what the common cells leave to u.
    crossing = fft.rfft(below * (1.0 - below))
    begins = np.maximum(fft.irfft(spectrum ** (num_cells - 1) * crossing, size), 0.0)
    exceeds = np.maximum(1.0 - np.cumsum(whole), 0.0)
    sums: FloatArray = float(lowest) * num_cells + STEP * np.arange(size, dtype=np.float64)
    return sums, exceeds, begins


def evidence_threshold(
    rate: float, num_cells: int, num_rows: int, num_shifts: float, num_antennas: int = 1
) -> float:
    """Evidence that windows of noise exceed `rate` times a frame, in nats.

    Parameters
    ----------
    rate : float
        Expected number of runs of windows above the threshold.
    num_cells : int
        Cells W of a window.
    num_rows : int
        Courses of windows, each of which may begin above the threshold.
    num_shifts : float
        Steps by one cell, of all courses together.
    num_antennas : int
        A.

    Examples
    --------
    >>> round(evidence_threshold(0.01, 11, 256, 256 * 245), 1)
    11.0
    """
    values, exceeds, begins = _tails(num_cells, num_antennas)
    rates = num_rows * exceeds + num_shifts * begins
    above = np.flatnonzero(rates > rate)
    return float(values[min(above[-1] + 1, len(values) - 1)]) if len(above) else float(values[0])
