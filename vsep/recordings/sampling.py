"""Complex 1x or Complex 2x: which side of the band a sensor samples, told by its own echoes.

Texas Instruments' *Complex 1x* has beat frequencies from zero to the sample rate, *Complex 2x* both
signs up to half of it. A far target of a Complex 1x recording looks as one at a negative distance;
so does every target where the sign is the other one. Both explanations are weighed.
"""

from typing import Final, NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.recordings.settings import COMPLEX_1X, RAW_FORMATS, REAL, RecordingSettings
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence

FEWEST_SAMPLES: Final = 32
MIRROR_SHARE: Final = 0.9  # of the strong cells: how alike both halves of the spectrum may be
_FLOOR = 10.0  # times the median cell: from here on a cell is an echo's ...
_DYNAMIC = 1e-5  # ... within this range below the strongest
_IMAGE = 300.0  # a mirrored cell by so much stronger explains a cell as its image
_FIRST = 3  # cells next to zero, where offsets and near echoes spread to both sides
_FEW, _MOST = 0.15, 0.85  # of the levels at negative distances: none of them, all of them
# Echoes weaken with distance. Where all lie at negative ones, their mean place on the half of the
# band is near zero for the other sign, far from it for Complex 1x; the order of I and Q in a
# raw capture speaks for the latter.
_BALANCE: Final = {False: 0.25, True: 0.08}


class Halves(NamedTuple):
    """Power over beat frequency, from zero outwards, at negative and at positive distances."""

    negative: FloatArray
    positive: FloatArray

    @property
    def likeness(self) -> float:
        """How alike both halves are, one for mirror images."""
        power = np.sqrt(self.negative.sum() * self.positive.sum())
        return float(np.sum(np.sqrt(self.negative * self.positive)) / power) if power else 0.0


def halves(received: ComplexArray, slope_hz_per_s: float) -> Halves:
    """Power of a frame (..., ramps, samples) in the paper's sign over the beat frequency.

    By the median over the ramps, which bursts do not move, from the second half of a ramp, where
    the receiver has settled, and without the lowest frequencies, where offsets live.
    """
    settled = received[..., received.shape[-1] // 2 :]
    count = settled.shape[-1]
    spectra = np.fft.ifft(settled * np.blackman(count), axis=-1)
    power = np.median(np.abs(spectra) ** 2, axis=-2)
    power = power.reshape(-1, count).sum(axis=0)
    first, last = min(_FIRST, max(1, count // 16)), count // 2
    upper, lower = power[first:last], power[-first:-last:-1]
    return Halves(lower, upper) if slope_hz_per_s > 0.0 else Halves(upper, lower)


def is_one_sided(both: Halves) -> bool:
    """Whether echoes lie in both halves of the band and are no images: Complex 1x."""
    return _at_negative(both)[0] >= _FEW and both.likeness <= MIRROR_SHARE


def lowest_beat(
    received: ComplexArray, radar: ChirpSequence, settings: RecordingSettings
) -> tuple[float, tuple[str, ...]]:
    """Return the lower edge of the beat frequencies, and what was taken and why.

    Parameters
    ----------
    received : (A, P, N) complex
        In the paper's sign.
    radar : ChirpSequence
        The radar as it is without knowing.
    settings : RecordingSettings
        What was said.
    """
    one_sided = 0.0 if radar.slope_hz_per_s > 0.0 else -1.0
    told = one_sided if settings.samples in {REAL, COMPLEX_1X} else -0.5
    if settings.lowest_beat is not None and settings.samples != REAL:
        told = settings.lowest_beat
    is_open = settings.samples == "complex" and settings.lowest_beat is None
    if not is_open or radar.num_samples < FEWEST_SAMPLES:
        return told, ()
    both = halves(received, radar.slope_hz_per_s)
    share, place = _at_negative(both)
    reach_m = radar.sample_rate_hz / abs(radar.slope_hz_per_s) * SPEED_OF_LIGHT_MPS / 2.0
    if share < _FEW or both.likeness > MIRROR_SHARE:
        return -0.5, _against_format(both, settings, reach_m)
    if share < _MOST:
        return one_sided, (
            f"Echoes lie on both sides of zero beat frequency, {share:.0%} of their levels at "
            "negative distances if the samples were Complex 2x, and no sign makes all of them "
            f"positive: Complex 1x is taken, with distances from 0 to {reach_m:.3g} m. "
            "samples: complex-2x keeps the negative ones.",
        )
    cells = 2 * (len(both.negative) + _FIRST)
    strongest = (int(np.argmax(both.negative)) + _FIRST) / cells
    near_m, far_m = strongest * reach_m, (1.0 - strongest) * reach_m
    is_raw = settings.format in RAW_FORMATS and settings.sign == "positive"
    begun = (
        f"{share:.0%} of the static energy lies at negative distances; sign ({settings.sign}) is "
        if not is_raw
        else f"All echoes lie at negative distances if the samples are Complex 2x; sign "
        f"({settings.sign}) is "
    )
    other = "negative" if settings.sign == "positive" else "positive"
    if place < _BALANCE[is_raw]:
        return -0.5, (
            f"{begun}perhaps the other one: with sign: {other} the strongest echo lies at "
            f"{near_m:.3g} m. By samples: complex-1x it lies at {far_m:.3g} m, which fits less: "
            "echoes weaken with distance, and these are strongest next to zero beat frequency.",
        )
    why = (
        f"format {settings.format} fixes the order of I and Q, and with it the sign"
        if is_raw
        else "the echoes lie far from zero beat frequency, where none are strongest"
    )
    return one_sided, (
        f"{begun}the other one, or the samples are Complex 1x. The latter is taken, since {why}: "
        f"the strongest echo lies at {far_m:.3g} m. With samples: complex-2x and sign: {other} it "
        f"would lie at {near_m:.3g} m.",
    )


def _at_negative(both: Halves) -> tuple[float, float]:
    """Share of the echoes' levels at negative distances, and their mean place from 0 to 1/2."""
    every = np.concatenate(both)
    floor = max(_FLOOR * float(np.median(every)), _DYNAMIC * float(every.max()))
    if floor <= 0.0:
        return 0.0, 0.0
    levels = [np.log(np.maximum(half / floor, 1.0)) for half in both]
    mirrored = both.positive
    around = np.maximum(mirrored, np.maximum(np.roll(mirrored, 1), np.roll(mirrored, -1)))
    negative = np.where(around > _IMAGE * both.negative, 0.0, levels[0])
    total = float(negative.sum() + levels[1].sum())
    if negative.sum() == 0.0 or total == 0.0:
        return 0.0, 0.0
    places = (np.arange(negative.size) + _FIRST) / (2.0 * (negative.size + _FIRST))
    return float(negative.sum()) / total, float(np.sum(places * negative) / negative.sum())


def _against_format(both: Halves, settings: RecordingSettings, reach_m: float) -> tuple[str, ...]:
    """Say what else fits where a raw capture is given the sign that its words do not have."""
    if settings.format not in RAW_FORMATS or settings.sign != "negative":
        return ()
    if settings.samples == REAL or both.likeness > MIRROR_SHARE:
        return ()
    mirrored = Halves(both.positive, both.negative)
    if _at_negative(mirrored)[1] < _BALANCE[True]:
        return ()
    cells = 2 * (len(both.positive) + _FIRST)
    strongest = (int(np.argmax(both.positive)) + _FIRST) / cells
    return (
        f"sign: negative puts the strongest echo at {strongest * reach_m:.3g} m, but the order of "
        f"I and Q in format {settings.format} gives targets positive beat frequencies. With "
        f"sign: positive and samples: complex-1x it lies at {(1.0 - strongest) * reach_m:.3g} m, "
        "which fits the format; only exchanged I and Q (SampleSwap, iqSwapSel) speak for "
        "sign: negative.",
    )
