"""Evidence for a layout of raw words: what the samples look like if it is taken.

Of the right layout echoes are few narrow lines in range and Doppler. A wrong order of I, Q or
receivers makes images, a wrong length of the ramp breaks the lines.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.special import digamma

from vsep._typing import ComplexArray, FloatArray
from vsep.recordings.layouts import image_share
from vsep.recordings.sampling import halves, is_one_sided
from vsep.units import to_db

ECHO: Final = 10.0  # times the noise: from here on a cell holds an echo
MAP_ROWS, MAP_COLUMNS = 48, 64
_LOUD = 4.5  # standard deviations: samples of bursts lie above ...
_USUAL, _NORMAL = 0.9, 1.645  # ... by this quantile of the magnitudes, in standard deviations
_MAP_DB = 50.0  # below the strongest cell: what a picture shows
_OVER_MEDIAN = 4.0  # of the range spectrum: cells with echoes


@dataclass(frozen=True, kw_only=True, slots=True)
class Evidence:
    """What speaks for a layout."""

    echo_share: float  #: of the range-Doppler cells that hold echoes; little is good
    flatness_db: float  #: geometric over arithmetic mean of the range spectra; low is good
    #: levels of the weaker halves of the spectra to those of the stronger; None of real samples,
    #: and of those of Complex 1x with echoes in both halves
    image_db: float | None
    ramp_likeness: float  #: correlation of a ramp with the next one of its channel, 0 to 1
    antenna_likeness: float  #: of the channels' range spectra, 0 to 1

    def __str__(self) -> str:
        """Write it on a line."""
        images = "" if self.image_db is None else f", images {self.image_db:.0f} dB"
        return (
            f"echoes in {self.echo_share:.2%} of the cells, spectra {-self.flatness_db:.1f} dB "
            f"from flat{images}, ramps alike {self.ramp_likeness:.2f}, antennas alike "
            f"{self.antenna_likeness:.2f}"
        )


def quiet(words: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
    """Return words around zero, twice: those of bursts left out, and clipped."""
    values = words.astype(np.float64)
    values -= np.median(values)
    highest = _LOUD * float(np.quantile(np.abs(values), _USUAL)) / _NORMAL
    if highest == 0.0:
        return values, values
    kept = np.where(np.abs(values) > highest, 0.0, values)
    return kept, np.clip(values, -highest, highest)


def range_spectra(samples: NDArray[Any]) -> ComplexArray:
    """Spectra (ramps, channels, cells) over fast time, of one energy with the samples."""
    count = samples.shape[-1]
    window = _window(count)
    if samples.dtype.kind == "c":
        return np.asarray(fft.fft(samples * window, axis=-1) / math.sqrt(count))
    return np.asarray(fft.rfft(samples * window, axis=-1)[..., 1:-1] * math.sqrt(2.0 / count))


def flatness(spectra: ComplexArray) -> float:
    """Log of the geometric over the arithmetic mean of the mean spectrum; zero for noise."""
    power = np.mean(np.abs(spectra) ** 2, axis=(0, 1))
    mean = float(power.mean())
    if mean == 0.0:
        return 0.0
    averaged = spectra.shape[0] * spectra.shape[1]
    # A mean of so few exponential values has this log on average
    bias = float(digamma(averaged)) - math.log(averaged)
    return float(np.mean(np.log(power + 1e-12 * mean))) - math.log(mean) - bias


def in_turns(spectra: ComplexArray, num_turns: int) -> ComplexArray:
    """Spectra with every one of so many successive ramps in a channel of its own."""
    ramps, channels, cells = spectra.shape
    return spectra.reshape(ramps // num_turns, num_turns * channels, cells)


def doppler_power(spectra: ComplexArray) -> FloatArray:
    """Power of the range-Doppler maps (ramps, channels, cells)."""
    count = len(spectra)
    maps = fft.fft(spectra * _window(count)[:, None, None], axis=0)
    return np.asarray(maps.real**2 + maps.imag**2) / count


def noise_of(power: FloatArray) -> float:
    """Noise of a map by its median; cells of receivers that are switched off do not count."""
    present = power[power > 0.0]
    return float(np.median(present)) / math.log(2.0) if present.size else 0.0


def cost(power: FloatArray, noise: float) -> float:
    """Mean of the echoes' levels in the cells, in nats: what it takes to write them down."""
    return float(np.mean(np.log(np.maximum(power / (ECHO * noise), 1.0))))


def evidence(samples: NDArray[Any], spectra: ComplexArray, noise: float) -> tuple[Evidence, bool]:
    """Return the evidence, and whether the samples are Complex 1x.

    Parameters
    ----------
    samples, spectra : (ramps, channels, ...) array
        In the layout.
    noise : float
        Of the maps.
    """
    power = doppler_power(spectra)
    one_sided, image_db = False, None
    if samples.dtype.kind == "c":
        both = halves(np.moveaxis(np.conj(samples), 1, 0), 1.0)
        one_sided = is_one_sided(both)
        if not one_sided:
            image_db = float(to_db(max(image_share(samples), 1e-12)))
    return Evidence(
        echo_share=float(np.mean(power > ECHO * noise)),
        flatness_db=10.0 * flatness(spectra) / math.log(10.0),
        image_db=image_db,
        ramp_likeness=ramp_likeness(spectra),
        antenna_likeness=_antenna_likeness(spectra),
    ), one_sided


def picture_of(spectra: ComplexArray, noise: float, *, centred: bool) -> NDArray[np.uint8]:
    """Return a small range-Doppler map, Doppler zero in the middle: levels from 0 for noise to 255.

    `centred`: whether zero range stands in the middle, too.
    """
    power = fft.fftshift(doppler_power(spectra).mean(axis=1), axes=0)
    if centred:
        power = fft.fftshift(power, axes=1)
    for axis, most in ((0, MAP_ROWS), (1, MAP_COLUMNS)):
        starts = np.unique(np.arange(most) * power.shape[axis] // most)
        power = np.maximum.reduceat(power, starts, axis=axis)
    level_db = to_db(np.maximum(power / noise, 1.0))
    top_db = max(float(np.max(level_db)), 20.0)
    low_db = max(top_db - _MAP_DB, 0.0)
    share = np.clip((level_db - low_db) / (top_db - low_db), 0.0, 1.0)
    return np.asarray(255.0 * share, dtype=np.uint8)


def _window(count: int) -> FloatArray:
    window = np.hanning(count + 2)[1:-1]
    return np.asarray(window / np.sqrt(np.mean(window**2)))


def ramp_likeness(spectra: ComplexArray) -> float:
    """Correlation of a ramp with the next one of its channel, over the range cells with echoes."""
    power = np.mean(np.abs(spectra) ** 2, axis=(0, 1))
    echoes = spectra[..., power >= min(_OVER_MEDIAN * float(np.median(power)), float(power.max()))]
    total = float(np.sum(np.abs(echoes) ** 2))
    products = np.sum(np.conj(echoes[:-1]) * echoes[1:], axis=0)
    # So many ramps alike: noise, too, has a mean product
    scale = total * (1.0 - 1.0 / len(echoes))
    return min(float(np.sum(np.abs(products))) / scale, 1.0) if total else 0.0


def _antenna_likeness(spectra: ComplexArray) -> float:
    power = np.mean(np.abs(spectra) ** 2, axis=0)
    power = power[power.sum(axis=1) > 0.0]
    mean = power.mean(axis=0)
    scale = np.sqrt(power.sum(axis=1) * mean.sum())
    return float(np.min(np.sum(np.sqrt(power * mean), axis=1) / scale)) if len(power) else 0.0
