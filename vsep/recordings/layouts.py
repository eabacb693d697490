"""Orders of words in raw captures, compared by what the samples look like.

In the right order an echo is one line over the beat frequency; in a wrong one it has images and
copies. The number of cells that hold most of the energy tells the orders apart.
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
FEWER_CELLS: Final = 0.65  # of those of the given order: what another must reach to be named
_SAME: Final = {"tsw1400": "tda2"}


def occupied_cells(samples: NDArray[Any]) -> float:
    """Return how many cells over beat frequency hold the energy: one over the sum of squares.

    Examples
    --------
    >>> line = np.exp(0.5j * np.arange(64))
    >>> occupied_cells(line[None]) < occupied_cells(line.real[None])
    True
    """
    window = np.hanning(samples.shape[-1])
    power = np.abs(np.fft.fft(samples * window, axis=-1)) ** 2
    share = power.reshape(-1, samples.shape[-1]).mean(axis=0)
    return float(share.sum() ** 2 / max(float(np.sum(share**2)), 1e-300))


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
    return best if best != own and cells[best] < FEWER_CELLS * cells[own] else None


def remark_of_format(name: str, settings: RecordingSettings) -> str:
    """Say which format fits better."""
    return (
        f"The words do not look as format {settings.format} orders them: echoes have images. The "
        f"order {ORDERS[name]} makes lines of them; say format: {name}."
    )
