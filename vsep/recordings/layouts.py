"""Orders of words in raw captures, compared by what the samples look like.

In the right order an echo is one line over the beat frequency; in a wrong one it has images and
copies. The number of cells that stand out of the noise tells the orders apart.
"""

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep.recordings.settings import REAL, RecordingSettings

ORDERS: Final = {
    "dca1000-xwr14xx": "I1 I2 I3 I4 Q1 Q2 Q3 Q4",
    "dca1000-xwr16xx": "one receiver after the other, I(n) I(n+1) Q(n) Q(n+1)",
    "tda2": "I1 Q1 I2 Q2 I3 Q3 I4 Q4",
    "tsw1400-xwr16xx": "one receiver after the other, I(n) Q(n)",
}
_OVER_NOISE = 20.0  # times the median cell
_DYNAMIC = 1e-5  # of the strongest cell
MANY_CELLS: Final = 24  # of which images are told apart from noise
FEWER_CELLS: Final = 0.65  # of those of the given order: what another must reach to be named
_SAME: Final = {"tsw1400": "tda2"}


def occupied_cells(samples: NDArray[Any]) -> int:
    """Return how many cells over beat and Doppler frequency stand out of the noise.

    Parameters
    ----------
    samples : (ramps, antennas, samples) complex

    Examples
    --------
    >>> line = np.exp(0.5j * np.arange(64)) + np.zeros((8, 1, 1))
    >>> occupied_cells(line) < occupied_cells(line.real)
    True
    """
    window = np.hanning(len(samples))[:, None, None] * np.blackman(samples.shape[-1])
    power = np.mean(np.abs(np.fft.fft2(samples * window, axes=(0, 2))) ** 2, axis=1)
    floor = max(_OVER_NOISE * float(np.median(power)), _DYNAMIC * float(power.max()))
    return int(np.count_nonzero(power > floor))


def better_format(
    words: NDArray[np.int32], settings: RecordingSettings, num_ramps: int, read: Any
) -> str | None:
    """Return a format whose order fits the words clearly better than that of the settings.

    Parameters
    ----------
    words : (W,) int
        Signed words of whole ramps.
    settings : RecordingSettings
        What was said.
    num_ramps : int
        How many ramps they hold.
    read : callable
        Puts words into their places as settings say.
    """
    num_samples = settings.num_samples or 0
    # Other numbers of receivers make other lengths of a ramp.
    if settings.samples == REAL or settings.num_antennas != 4 or num_samples % 2:
        return None
    own = _SAME.get(settings.format, settings.format)
    cells = {
        name: occupied_cells(read(words, replace(settings, format=name), num_ramps))
        for name in ORDERS
    }
    best = min(cells, key=lambda name: cells[name])
    fits = 0 < cells[best] < FEWER_CELLS * cells[own] and cells[own] >= MANY_CELLS
    return best if fits else None


def remark_of_format(name: str, settings: RecordingSettings) -> str:
    """Say which format fits better."""
    return (
        f"The words do not look as format {settings.format} orders them: echoes have images. The "
        f"order {ORDERS[name]} makes lines of them; say format: {name}."
    )
