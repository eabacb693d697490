"""Recordings in SigMF, the Signal Metadata Format: metadata in JSON beside a file of samples.

A stream of samples by ``core:sample_rate``; what a radar's frame needs more stands in fields of the
extension ``vsep``. Of a stream that others wrote `num_samples` cuts the ramps.
"""

import os
import re
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._optional import require_library
from vsep.errors import InputError
from vsep.files.archive import MAX_SAMPLES
from vsep.files.frame import Frame
from vsep.files.opening import open_regular, read_bounded
from vsep.files.writing import write_text, written_beside

META, DATA = ".sigmf-meta", ".sigmf-data"
FIELDS: Final = (
    "slope_hz_per_s",
    "ramp_period_s",
    "num_samples",
    "sign",
    "lowest_beat",
    "antenna_spacing_wavelengths",
)
_MAX_META = 2**20
_TYPE = re.compile(r"([cr])(f64|f32|i32|i16|u32|u16|i8|u8)(_le|_be)?")
_KINDS = {"f64": "f8", "f32": "f4", "i32": "i4", "i16": "i2", "u32": "u4", "u16": "u2"}


def read_sigmf(path: str, key: str | None) -> NDArray[Any]:
    """Read the samples of a stream, (samples, channels).

    Parameters
    ----------
    path : str
        Of the metadata or of the samples.
    key : str or None
        Must not be given: a stream has no names.

    Raises
    ------
    InputError
        If the library sigmf is missing, or whatever is wrong with the files.
    """
    if key is not None:
        raise InputError(f"key is {key[:40]!r}; a SigMF recording holds one stream without a name.")
    said = _metadata(path)["global"]
    match = _TYPE.fullmatch(str(said.get("core:datatype")))
    if match is None:
        raise InputError(f"{path}: core:datatype is {str(said.get('core:datatype'))[:20]!r}.")
    order = ">" if match[3] == "_be" else "<"
    kind = np.dtype(order + _KINDS.get(match[2], f"{match[2][0]}1"))
    parts = 2 if match[1] == "c" else 1
    channels = int(said.get("core:num_channels", 1))
    data = str(Path(path).with_suffix(DATA))
    with open_regular(data, data, "the samples of a SigMF recording") as file:
        count = os.fstat(file.fileno()).st_size // kind.itemsize
        per_sample = parts * channels
        if not 1 <= channels <= 1024 or count < per_sample or count > 2 * MAX_SAMPLES:
            raise InputError(
                f"{data} holds {count} numbers of {channels} channels; at least one sample of each "
                f"and at most {2 * MAX_SAMPLES} numbers are needed."
            )
        numbers = np.fromfile(file, dtype=kind, count=count // per_sample * per_sample)
    numbers = numbers.reshape(-1, channels, parts)
    if parts == 1:
        return numbers[..., 0]
    samples = np.empty(numbers.shape[:2], dtype=np.complex128)
    samples.real, samples.imag = numbers[..., 0], numbers[..., 1]
    return samples


def sigmf_settings(path: str) -> dict[str, Any]:
    """Return settings as far as the metadata tell them.

    Raises `InputError` as `read_sigmf` does.
    """
    said = _metadata(path)
    fields = said["global"]
    found = {name: fields[f"vsep:{name}"] for name in FIELDS if f"vsep:{name}" in fields}
    captures = said["captures"]
    start = captures[0].get("core:frequency") if captures else None
    if start is not None:
        found["start_frequency_hz"] = start
    if "core:sample_rate" in fields:
        found["sample_rate_hz"] = fields["core:sample_rate"]
    if str(fields.get("core:datatype")).startswith("r"):
        found["samples"] = "real"
    return found


def write_sigmf(path: str, frame: Frame) -> None:
    """Write a frame: samples in double precision and the sign of its file, ramp after ramp.

    The filter is not kept.

    Parameters
    ----------
    path : str
        Of the metadata, ``*.sigmf-meta``; the samples stand beside.
    frame : Frame
        Without missing samples, of which SigMF keeps no mask.

    Raises
    ------
    InputError
        If the library sigmf is missing, samples are missing, or the name has another suffix.
    """
    if Path(path).suffix != META:
        raise InputError(f"{path} must end in {META}.")
    if frame.missing is not None:
        raise InputError(f"{frame.name} has missing samples, which SigMF does not keep; use .npz.")
    sigmf = require_library("sigmf", f"{path} is SigMF; it", "sigmf")
    signal = frame.received[None] if frame.antennas is None else frame.antennas
    in_sign = signal if frame.beat_sign == -1 else np.conj(signal)
    stream = np.moveaxis(in_sign, 0, -1).astype("<c16")
    data = Path(path).with_suffix(DATA)
    with written_beside(data) as beside:
        stream.tofile(beside)
    values = {
        "slope_hz_per_s": frame.radar.slope_hz_per_s,
        "ramp_period_s": frame.radar.ramp_period_s,
        "num_samples": frame.radar.num_samples,
        "sign": "positive" if frame.beat_sign > 0 else "negative",
        "lowest_beat": frame.radar.lowest_beat,
        "antenna_spacing_wavelengths": frame.antenna_spacing_wavelengths,
    }
    recording = sigmf.SigMFFile(
        data_file=str(data),
        global_info={
            "core:datatype": "cf64_le",
            "core:sample_rate": frame.radar.sample_rate_hz,
            "core:num_channels": len(signal),
            "core:description": "Ramps of a frequency-modulated radar, one after the other",
            "core:extensions": [{"name": "vsep", "version": "1.0.0", "optional": True}],
            **{f"vsep:{name}": value for name, value in values.items() if value is not None},
        },
    )
    start = {"core:frequency": frame.radar.start_frequency_hz}
    recording.add_capture(0, metadata=start)
    recording.validate()
    write_text(path, f"{recording.dumps()}\n")


def _metadata(path: str) -> dict[str, Any]:
    """Read and judge the metadata of a recording."""
    sigmf = require_library("sigmf", f"{path} is SigMF; it", "sigmf")
    meta = str(Path(path).with_suffix(META))
    try:
        text = read_bounded(meta, meta, "the metadata of a SigMF recording", _MAX_META).decode()
        said = sigmf.SigMFFile(metadata=text)
        said.validate()
        return {"global": said.get_global_info(), "captures": said.get_captures()}
    except InputError:
        raise
    # Whatever the library's schema or JSON refuses.
    except Exception as error:
        raise InputError(f"{meta} is no metadata of SigMF; write it again.") from error
