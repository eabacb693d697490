"""Orders of words in raw captures, compared by what the samples look like.

In the right order an echo lies at one side of zero beat frequency; where I and Q of different
samples or receivers are taken for one sample it has an image at the other side.
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
IMAGES: Final = 0.01  # share of images from which an order is doubted ...
FEWEST_SAMPLES: Final = 32
FEWER: Final = 0.3  # ... if another one has less than this of it
_FIRST = 3  # cells next to zero, which spread to both sides
_SAME: Final = {"tsw1400": "tda2"}
FOUR_LANES = 4
RECEIVERS_IN_TURN: Final = ("dca1000-xwr16xx", "tsw1400-xwr16xx")


def image_share(samples: NDArray[Any]) -> float:
    """Return how strong the weaker sides of the band are, as a share of the stronger ones.

    By the median over the ramps, which bursts do not move, and from the second half of a ramp,
    where the receiver has settled.

    Parameters
    ----------
    samples : (ramps, antennas, samples) complex

    Examples
    --------
    >>> line = np.exp(0.5j * np.arange(64)) + np.zeros((8, 1, 1))
    >>> round(image_share(line), 3), round(image_share(line.real), 3)
    (0.0, 1.0)
    """
    settled = samples[..., samples.shape[-1] // 2 :]
    count = settled.shape[-1]
    spectra = np.fft.fft(settled * np.blackman(count), axis=-1)
    power = np.median(np.abs(spectra) ** 2, axis=0)
    upper, lower = power[..., _FIRST : count // 2], power[..., -_FIRST : -(count // 2) : -1]
    stronger = float(np.maximum(upper, lower).sum())
    return float(np.minimum(upper, lower).sum()) / stronger if stronger else 1.0


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
    if settings.samples == REAL or num_samples % 2 or num_samples < FEWEST_SAMPLES:
        return None
    own = _SAME.get(settings.format, settings.format)
    # Four lanes are all in the file, receivers in turn only those that are on.
    same = settings.num_antennas == FOUR_LANES
    orders = [
        name for name in ORDERS if same or (name in RECEIVERS_IN_TURN) == (own in RECEIVERS_IN_TURN)
    ]
    images = {
        name: image_share(read(words, replace(settings, format=name), num_ramps)) for name in orders
    }
    best = min(images, key=lambda name: images[name])
    doubted = images[own] > IMAGES and images[best] < FEWER * images[own]
    return best if doubted else None


def remark_of_format(name: str, settings: RecordingSettings) -> str:
    """Say which format fits better."""
    return (
        f"The words do not look as format {settings.format} orders them: echoes have images. The "
        f"order {ORDERS[name]} has hardly any; say format: {name}."
    )
