"""A frame of a recording: samples from its file, everything else from the settings."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray
from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.filter_keys import read_filter
from vsep.files.frame import Frame
from vsep.recordings.advice import advice
from vsep.recordings.axes import arranged, complex_at_half_rate, virtual_antennas
from vsep.recordings.raw_words import read_raw
from vsep.recordings.settings import RAW_FORMATS, RecordingSettings
from vsep.recordings.stored_arrays import read_stored_array
from vsep.recordings.suggest import is_frame
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence


def convert_recording(path: str, settings: RecordingSettings) -> tuple[Frame, tuple[str, ...]]:
    """Make a frame of a recording.

    Parameters
    ----------
    path : str
        The recording.
    settings : RecordingSettings
        What its file does not say.

    Returns
    -------
    frame : Frame
        Samples unchanged but for the choice of a frame, of antennas and of the samples kept; real
        ones become complex ones of half the rate. Its start frequency is that of the first sample
        kept, its ramp period that of one transmitter. The filter that a frame file names stays.
    remarks : tuple of str
        What looks wrong with the settings, with advice.

    Raises
    ------
    InputError
        In one sentence, whatever cannot be.
    """
    if settings.format in RAW_FORMATS:
        ramps, remarks = read_raw(path, settings)
    else:
        ramps, remarks = arranged(path, read_stored_array(path, settings), settings), ()
    _require_kind(path, ramps, settings)
    _require_duration(ramps.shape[-1], settings)
    signal = virtual_antennas(ramps, settings.num_transmitters)
    crop = settings.crop_start_samples
    if crop >= signal.shape[-1]:
        raise InputError(
            f"crop_start_samples is {crop}, but a ramp of {path} has {signal.shape[-1]} samples."
        )
    frame = _frame(path, signal[..., crop:], settings)
    return frame, (*remarks, *advice(frame, settings))


def _frame(path: str, signal: NDArray[Any], settings: RecordingSettings) -> Frame:
    rate, lowest_beat = settings.sample_rate_hz, settings.lowest_beat
    beat_sign = 1 if settings.sign == "positive" else -1
    if settings.samples == "real":
        # The half kept has positive frequencies: a falling ramp has them in the paper's sign,
        # where its beat frequencies are negative.
        rising = settings.slope_hz_per_s > 0.0
        beat_sign, lowest_beat = (1, 0.0) if rising else (-1, -1.0)
        signal = complex_at_half_rate(signal)
        rate *= 0.5
    received: ComplexArray = signal.astype(np.complex128)
    if beat_sign == 1:
        received = np.conj(received)
    start_s = settings.adc_start_s + settings.crop_start_samples / settings.sample_rate_hz
    radar = ChirpSequence(
        start_frequency_hz=settings.start_frequency_hz + settings.slope_hz_per_s * start_s,
        slope_hz_per_s=settings.slope_hz_per_s,
        sample_rate_hz=rate,
        ramp_period_s=settings.ramp_period_s * settings.num_transmitters,
        num_samples=received.shape[2],
        num_ramps=received.shape[1],
        lowest_beat=lowest_beat,
    )
    return Frame(
        received=received[0],
        radar=radar,
        anti_aliasing_filter=_own_filter(path, settings, beat_sign),
        name=path,
        beat_sign=beat_sign,
        antennas=received if len(received) > 1 else None,
        antenna_spacing_wavelengths=settings.antenna_spacing_wavelengths,
    )


def _own_filter(
    path: str, settings: RecordingSettings, beat_sign: int
) -> AntiAliasingFilter | None:
    """Return the filter of a frame file, whatever else of it the settings change."""
    if settings.format != "npz" or settings.samples == "real":
        return None
    with Archive(path, path) as archive:
        return read_filter(archive, beat_sign) if is_frame(archive) else None


def _require_kind(path: str, ramps: NDArray[Any], settings: RecordingSettings) -> None:
    if ramps.size == 0:
        raise InputError(f"{path} holds an array without samples; a recording is needed.")
    is_real = ramps.dtype.kind != "c"
    if is_real and settings.samples == "complex":
        raise InputError(
            f"{path} holds real numbers; name an axis iq that holds I and Q, or say samples: real."
        )
    if not is_real and settings.samples == "real":
        raise InputError(f"{path} holds complex numbers, but samples is 'real'.")


def _require_duration(num_samples: int, settings: RecordingSettings) -> None:
    """Refuse ramps that last longer than from one to the next."""
    duration_s = settings.adc_start_s + (num_samples - 1) / settings.sample_rate_hz
    if duration_s > settings.ramp_period_s:
        raise InputError(
            f"ramp_period_s is {settings.ramp_period_s:g} s, but adc_start_s and {num_samples} "
            f"samples at {settings.sample_rate_hz:g} Hz take {duration_s:g} s; check "
            "sample_rate_hz and the axes."
        )
