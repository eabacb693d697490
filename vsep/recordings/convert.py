"""A frame of a recording: samples from its file, everything else from the settings."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray
from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.files.filter_keys import read_filter
from vsep.files.frame import Frame
from vsep.files.frame_checks import require_usable
from vsep.recordings.advice import advice
from vsep.recordings.axes import arranged, of_one_chirp, virtual_antennas
from vsep.recordings.captured import Captured
from vsep.recordings.half_band import complex_at_half_rate, half_band, missing_at_half_rate
from vsep.recordings.migration import visible_walker
from vsep.recordings.missing_samples import (
    LEAST_RUN,
    LEAST_SAMPLES,
    remark_of_missing,
    zero_runs,
)
from vsep.recordings.raw_words import read_raw
from vsep.recordings.readers import READERS
from vsep.recordings.receivers import kept_receivers, spacing_of, without_offset
from vsep.recordings.sampling import lowest_beat
from vsep.recordings.settings import COMPLEX_2X, RAW_FORMATS, REAL, RecordingSettings
from vsep.recordings.stored_arrays import STREAM_AXES, read_stored_array
from vsep.recordings.suggest import is_frame
from vsep.recordings.word_kinds import is_unsigned, wrapped
from vsep.signal.dithering import parse_starts
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence


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
    captured = _captured(path, settings)
    _require_kind(path, captured.samples, settings)
    num_samples = captured.samples.shape[-1]
    require_usable(path, captured.samples)
    _require_duration(num_samples, settings)
    if settings.crop_start_samples >= num_samples:
        raise InputError(
            f"crop_start_samples is {settings.crop_start_samples}, but a ramp of {path} has "
            f"{num_samples} samples."
        )
    captured = without_offset(kept_receivers(path, captured, settings), settings)
    frame, remarks = _frame(path, captured, settings)
    if np.all(frame.received == frame.received[0, 0]):
        raise InputError(f"{path}: all samples are equal; a recording is needed.")
    return frame, (*remarks, *advice(frame, settings))


def _captured(path: str, settings: RecordingSettings) -> Captured:
    if settings.format in RAW_FORMATS:
        return read_raw(path, settings)
    stored = read_stored_array(path, settings)
    if READERS[settings.format].is_stream:
        settings = replace(settings, axes=STREAM_AXES)
    settings, remarks = of_one_chirp(settings)
    samples = arranged(path, stored, settings)
    least = LEAST_RUN if settings.samples == REAL else LEAST_SAMPLES
    runs = zero_runs(samples.reshape(-1), least)
    missing = None if runs is None else runs.reshape(samples.shape)
    signed, remark = wrapped(samples)
    return Captured(
        samples=signed,
        missing=missing,
        remarks=(*remarks, remark) if remark else remarks,
        unit=1.0 if samples.dtype.kind in "iu" else 0.0,
        is_unsigned=is_unsigned(signed),
    )


def _frame(
    path: str, captured: Captured, settings: RecordingSettings
) -> tuple[Frame, tuple[str, ...]]:
    """Make the frame; what is taken is remarked."""
    crop = settings.crop_start_samples
    signal = virtual_antennas(captured.samples, settings.num_transmitters)[..., crop:]
    missing = captured.missing
    if missing is not None:
        missing = virtual_antennas(missing, settings.num_transmitters)[..., crop:]
    remarks = list(captured.remarks)
    rate = settings.sample_rate_hz
    beat_sign = 1 if settings.sign == "positive" else -1
    start_s = settings.adc_start_s + crop / rate
    if settings.samples == REAL:
        # The half kept has positive frequencies: a falling ramp has them in the paper's sign,
        # where its beat frequencies are negative.
        beat_sign = 1 if settings.slope_hz_per_s > 0.0 else -1
        remarks.append(_remark_of_real(signal.shape[-1], settings))
        start_s += half_band(signal.shape[-1]).delay / rate
        missing = None if missing is None else missing_at_half_rate(missing)
        signal = complex_at_half_rate(signal)
        rate *= 0.5
    if missing is not None and (missing.all() or not missing.any()):
        missing = None
    if missing is not None:
        remarks.append(remark_of_missing(np.moveaxis(missing, 0, 1)))
    received: ComplexArray = signal.astype(np.complex128)
    if beat_sign == 1:
        received = np.conj(received)
    radar = ChirpSequence(
        start_frequency_hz=settings.start_frequency_hz + settings.slope_hz_per_s * start_s,
        slope_hz_per_s=settings.slope_hz_per_s,
        sample_rate_hz=rate,
        ramp_period_s=settings.ramp_period_s * settings.num_transmitters,
        num_samples=received.shape[2],
        num_ramps=received.shape[1],
    )
    if captured.is_doubtful and settings.samples == "complex":
        settings = replace(settings, samples=COMPLEX_2X)
    lowest, taken = lowest_beat(received, radar, settings)
    starts = _starts(settings, radar.num_ramps)
    radar = replace(radar, **starts)
    migration = settings.range_migration == "modelled"
    if settings.range_migration == "automatic" and radar.needs_migration:
        placed = replace(radar, lowest_beat=lowest)
        migration = visible_walker(received, placed) is not None
    spacing = settings.antenna_spacing_wavelengths
    if settings.num_transmitters == 1:
        spacing = spacing_of(captured.kept, spacing)
    elif captured.kept is not None:
        spacing = None  # Gaps in each transmitter's part make no uniform line.
    division = settings.doppler_division
    frame = Frame(
        received=received[0],
        radar=replace(radar, lowest_beat=lowest, range_migration=migration),
        anti_aliasing_filter=_own_filter(path, settings, beat_sign),
        name=path,
        beat_sign=beat_sign,
        antennas=received if len(received) > 1 else None,
        antenna_spacing_wavelengths=spacing,
        missing=missing,
        num_transmitters=settings.num_transmitters,
        settings={} if division is None else {"doppler_division": division},
    )
    return frame, (*remarks, *taken)


def _starts(settings: RecordingSettings, num_ramps: int) -> dict[str, Any]:
    """Return the starts of dithered ramps as `ChirpSequence` takes them.

    Of transmitters that take turns there is a number for each turn, or for each ramp.
    """
    given = {name: getattr(settings, name) for name in ("start_times_s", "start_frequencies_hz")}
    found, count = {}, settings.num_transmitters
    for name, text in given.items():
        if text is None:
            continue
        starts = parse_starts(name, text, num_ramps)
        if len(starts) == count * num_ramps:
            turns = np.reshape(starts, (num_ramps, count))
            if np.any(turns != turns[:, :1]):
                raise InputError(
                    f"{name} differs between the {count} transmitters of a turn; dithered ramps "
                    "are modelled where it differs from turn to turn only."
                )
            starts = tuple(turns[:, 0].tolist())
        found[name] = starts
    return found


def _remark_of_real(num_samples: int, settings: RecordingSettings) -> str:
    """Say what the filter of real samples leaves of a ramp."""
    design = half_band(num_samples)
    kept = (num_samples - len(design.taps)) // 2 + 1
    cell_m = settings.sample_rate_hz / abs(settings.slope_hz_per_s) * SPEED_OF_LIGHT_MPS / 2.0
    return (
        f"Real samples became {kept} complex ones of half the rate by a filter of "
        f"{len(design.taps)} taps, which takes {len(design.taps) - 1} of {num_samples} samples at "
        f"the ramp's ends; within {design.transition * cell_m:.3g} m of both ends of the "
        f"{cell_m / 2.0:.3g} m of range an object may have an image at the other end."
    )


def _own_filter(
    path: str, settings: RecordingSettings, beat_sign: int
) -> AntiAliasingFilter | None:
    """Return the filter of a frame file, whatever else of it the settings change."""
    if settings.format != "npz" or settings.samples == REAL:
        return None
    with Archive(path, path) as archive:
        return read_filter(archive, beat_sign) if is_frame(archive) else None


def _require_kind(path: str, ramps: NDArray[Any], settings: RecordingSettings) -> None:
    if ramps.size == 0:
        raise InputError(f"{path} holds an array without samples; a recording is needed.")
    is_real = ramps.dtype.kind != "c"
    if is_real and settings.samples != REAL:
        raise InputError(
            f"{path} holds real numbers; name an axis iq that holds I and Q, or two arrays by "
            "key: I,Q, or say samples: real."
        )
    if not is_real and settings.samples == REAL:
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
