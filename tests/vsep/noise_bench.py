"""Noise of the spectra that receivers have, and lines in it, for tests of the false-alarm rate."""

import numpy as np

from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency

FILTER = RaisedCosineFilter(cutoff_hz=2.5e6, rolloff=0.35)
OVERSAMPLED = 8  # times the ramp: what lies beyond its ends is noise as well


def model_of(num_ramps, num_samples):
    return SignalModel(
        num_ramps=num_ramps,
        num_samples=num_samples,
        sample_rate_hz=1e7,
        anti_aliasing_filter=FILTER,
    )


def white(beats):
    return np.ones_like(beats)


def filtered(beats):
    """White noise ahead of the anti-aliasing filter, the filter that the model assumes."""
    return np.abs(FILTER.response(beats * 1e7)) ** 2


def flicker(beats):
    """1/f noise 20 dB over the floor at the lowest beat."""
    return 1.0 + 0.3 / np.maximum(np.abs(beats), 0.004)


def sloped(beats):
    return 10.0 ** (0.3 * np.cos(2.0 * np.pi * beats))


def of_a_sensor(beats):
    """High-pass below, ripple, and a roll-off of 8 dB towards the edges."""
    level_db = 1.5 * np.sin(9.0 * beats) - 8.0 * np.minimum(1.0, 2.0 * np.abs(beats)) ** 3
    return 10.0 ** ((level_db - 3.0 * np.exp(-((beats / 0.04) ** 2))) / 10.0)


def noise_of(spectrum, num_ramps, num_samples, rng):
    """(P, N) noise whose power spectrum over the beat is `spectrum`, cut out of a longer course."""
    size = OVERSAMPLED * num_samples
    draws = rng.standard_normal((2, num_ramps, size)) / np.sqrt(2.0)
    gain = np.sqrt(spectrum(np.fft.fftfreq(size)))
    course = np.fft.fft(np.fft.ifft(draws[0] + 1j * draws[1], axis=1) * gain, axis=1)
    return course[:, size // 2 : size // 2 + num_samples]


def lines_in(spectrum, num_lines, shape, rng, snr_db=(20.0, 50.0)):
    """Well separated lines (points, frame) of a component SNR over the noise at their beats."""
    beats = np.linspace(-0.21, 0.21, num_lines) + rng.uniform(-0.004, 0.004, num_lines)
    points = np.column_stack([beats, rng.uniform(-0.4, 0.4, num_lines)])
    levels = spectrum(beats) * 10.0 ** (rng.uniform(*snr_db, num_lines) / 10.0)
    ramps, samples = np.arange(shape[0])[:, None], np.arange(shape[1])
    frame = np.zeros(shape, dtype=np.complex128)
    for (beat, doppler), level in zip(points, levels, strict=True):
        phase = rng.uniform() + beat * samples + doppler * ramps
        frame += np.sqrt(level / frame.size) * np.exp(-2j * np.pi * phase)
    return points, frame


def nearest(objects, point, shape):
    """Index of the object nearest to a point and its signed errors; None beyond 0.7 cells."""
    errors = wrap_frequency(np.column_stack([objects.beats, objects.dopplers]) - point)
    cells = np.abs(errors * shape[::-1]).max(axis=1)
    index = int(np.argmin(cells))
    return (index, errors[index]) if cells[index] < 0.7 else None
