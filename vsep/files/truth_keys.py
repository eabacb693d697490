"""The truth of a simulated frame: the ``truth_*`` arrays of its file.

``truth_beat``, ``truth_doppler`` (L,) and ``truth_amplitude`` (L,) are in the paper's sign;
``truth_object_signal`` and ``truth_interference_signal`` have the shape and sign of ``received``;
``truth_noise_precision`` is a number; ``truth_bursts`` is (K, 3): ramp, start frequency in Hz and
slope in Hz/s of every burst. Of several antennas the amplitudes are (L, A), and ``truth_angle_deg``
(L,) and ``truth_interferer_angle_deg`` (I,) say where objects and interferers are.
``truth_waveform`` (I,) says what each of them sent, by its place in `vsep.parameters.WAVEFORMS`.
``truth_group`` (L,) numbers extended objects, -1 is a point.
Where oscillator or receivers were not perfect, ``truth_ramp_phases_rad`` (P,),
``truth_phase_noise_rad``, ``truth_image_factor`` and ``truth_offset`` say so. An incomplete
truth is no truth: nothing needs it. ``truth_mask``, boolean and of the shape of ``received``, says
by itself which samples are interfered.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, ComplexArray, FloatArray, IntArray, frozen
from vsep.errors import InputError
from vsep.files.archive import Archive
from vsep.parameters import WAVEFORMS
from vsep.signal.impairments import TrueReceiver
from vsep.signal.scene import GroundTruth, TrueBurst

_NEEDED = (
    "truth_beat",
    "truth_doppler",
    "truth_amplitude",
    "truth_object_signal",
    "truth_interference_signal",
)
_MAX_ROWS = 2**20
_NAMES = tuple(WAVEFORMS)


def read_truth(
    archive: Archive, shape: tuple[int, int], beat_sign: int, num_antennas: int = 1
) -> GroundTruth | None:
    """Read the truth; None where the file does not hold all of it.

    `archive`: the frame file; `shape` (int, int): ramps and samples of the frame; `beat_sign`: sign
    in which the file keeps its signals; `num_antennas`: of the file; amplitudes (L, A) tell that
    its truth is that of all of them. Raises `InputError` if an array has a wrong shape or type, or
    is not finite.
    """
    if any(key not in archive for key in _NEEDED):
        return None
    beats = _vector(archive, "truth_beat", "iuf")
    dopplers = _vector(archive, "truth_doppler", "iuf")
    amplitudes = _amplitudes(archive, num_antennas)
    full_shape = (num_antennas, *shape) if amplitudes.ndim == 2 else shape
    if not len(beats) == len(dopplers) == len(amplitudes):
        raise InputError(
            f"truth_beat, truth_doppler and truth_amplitude have {len(beats)}, {len(dopplers)} and "
            f"{len(amplitudes)} entries; all must have one per object."
        )
    return GroundTruth(
        beats=beats.astype(np.float64),
        dopplers=dopplers.astype(np.float64),
        amplitudes=amplitudes.astype(np.complex128),
        object_signal=_signal(archive, "truth_object_signal", full_shape, beat_sign),
        interference_signal=_signal(archive, "truth_interference_signal", full_shape, beat_sign),
        bursts=_read_bursts(archive, shape[0]),
        noise_precision=archive.number("truth_noise_precision", float("nan")),
        angles_deg=_angles(archive, "truth_angle_deg", len(beats)),
        interferer_angles_deg=_angles(archive, "truth_interferer_angle_deg"),
        receiver=_read_receiver(archive, shape[0], full_shape),
        waveforms=_read_waveforms(archive),
        groups=_groups(archive, len(beats)),
    )


def read_truth_mask(archive: Archive, shape: tuple[int, int]) -> BoolArray | None:
    """Read which samples are interfered; None where the file does not say.

    `archive`: the frame file; `shape` (int, int): ramps and samples of the frame. Raises
    `InputError` if the mask is not boolean or has another shape than the frame.
    """
    if "truth_mask" not in archive:
        return None
    mask = archive.array("truth_mask")
    shapes = [shape, shape[1:]] if shape[0] == 1 else [shape]
    if mask.dtype != np.bool_ or mask.shape not in shapes:
        raise InputError(
            f"truth_mask has shape {mask.shape} and type {mask.dtype}; it must be boolean and of "
            f"the shape of received, {shape}."
        )
    return frozen(mask.reshape(shape))


def truth_arrays(
    truth: GroundTruth, in_file_sign: Callable[[ComplexArray], ComplexArray]
) -> dict[str, Any]:
    """Return the ``truth_*`` arrays that `read_truth` turns into the same truth.

    `truth`: in the paper's sign; `in_file_sign`: turns a signal into the sign and shape of the
    file.
    """
    bursts = [
        (burst.ramp, burst.start_frequency_hz, burst.slope_hz_per_s) for burst in truth.bursts
    ]
    angles = {
        "truth_angle_deg": truth.angles_deg,
        "truth_interferer_angle_deg": truth.interferer_angles_deg,
    }
    return {
        **{key: value for key, value in angles.items() if value is not None},
        **({} if truth.groups is None else {"truth_group": truth.groups}),
        **({} if truth.receiver is None else _receiver_arrays(truth.receiver)),
        "truth_beat": truth.beats,
        "truth_doppler": truth.dopplers,
        "truth_amplitude": truth.amplitudes,
        "truth_object_signal": in_file_sign(truth.object_signal),
        "truth_interference_signal": in_file_sign(truth.interference_signal),
        "truth_bursts": np.array(bursts, dtype=np.float64).reshape(-1, 3),
        "truth_noise_precision": truth.noise_precision,
        "truth_waveform": np.array(
            [_NAMES.index(each) for each in truth.waveforms], dtype=np.int64
        ),
    }


def _receiver_arrays(receiver: TrueReceiver) -> dict[str, Any]:
    return {
        "truth_ramp_phases_rad": receiver.ramp_phases_rad,
        "truth_phase_noise_rad": receiver.phase_noise_rad,
        "truth_image_factor": np.array([receiver.image_factor]),
        "truth_offset": np.atleast_1d(receiver.offset),
    }


def _read_receiver(archive: Archive, num_ramps: int, shape: tuple[int, ...]) -> TrueReceiver | None:
    """Read what oscillator and receivers did; None where the file does not say."""
    keys = "truth_ramp_phases_rad", "truth_image_factor", "truth_offset"
    if any(key not in archive for key in keys):
        return None
    phases, factor, offset = (_vector(archive, key, "iufc") for key in keys)
    lengths = len(phases), len(factor), len(offset)
    expected = num_ramps, 1, shape[0] if len(shape) == 3 else 1
    if lengths != expected or phases.dtype.kind == "c":
        raise InputError(
            f"{', '.join(keys)} have {lengths} entries; they must have {expected}, the first of "
            "real numbers."
        )
    return TrueReceiver(
        ramp_phases_rad=frozen(phases.astype(np.float64)),
        phase_noise_rad=archive.number("truth_phase_noise_rad", float("nan")),
        image_factor=complex(factor[0]),
        offset=frozen(offset.astype(np.complex128) if len(shape) == 3 else offset[0] + 0j),
    )


def _read_waveforms(archive: Archive) -> tuple[str, ...]:
    """Read what the interferers sent; empty where the file does not say."""
    if "truth_waveform" not in archive:
        return ()
    places = _vector(archive, "truth_waveform", "iu")
    if np.any((places < 0) | (places >= len(_NAMES))):
        raise InputError(
            f"truth_waveform holds a number beyond 0 to {len(_NAMES) - 1}; they count the "
            "waveforms that interferers can send."
        )
    return tuple(_NAMES[place] for place in places.tolist())


def _read_bursts(archive: Archive, num_ramps: int) -> tuple[TrueBurst, ...]:
    if "truth_bursts" not in archive:
        return ()
    rows = archive.array("truth_bursts", max_elements=3 * _MAX_ROWS)
    if rows.ndim != 2 or rows.shape[1] != 3 or rows.dtype.kind not in "iuf":
        raise InputError(
            f"truth_bursts has shape {rows.shape} and type {rows.dtype}; it must be real, (K, 3)."
        )
    _require_finite("truth_bursts", rows)
    ramps = rows[:, 0]
    if np.any((ramps < 0) | (ramps >= num_ramps) | (ramps != np.round(ramps))):
        raise InputError(
            "truth_bursts names a ramp that the frame does not have; ramps are 0 to "
            f"{num_ramps - 1}."
        )
    return tuple(
        TrueBurst(ramp=int(ramp), start_frequency_hz=float(start), slope_hz_per_s=float(slope))
        for ramp, start, slope in rows
    )


def _vector(archive: Archive, key: str, kinds: str) -> NDArray[Any]:
    vector = archive.array(key, max_elements=_MAX_ROWS)
    if vector.ndim != 1 or vector.dtype.kind not in kinds:
        raise InputError(
            f"{key} has type {vector.dtype} and {vector.ndim} axes; a list of numbers is needed."
        )
    _require_finite(key, vector)
    return vector


def _amplitudes(archive: Archive, num_antennas: int) -> NDArray[Any]:
    """(L,) amplitudes, or (L, A) of all antennas."""
    key = "truth_amplitude"
    stored = archive.array(key, max_elements=_MAX_ROWS * num_antennas)
    if num_antennas == 1 or stored.ndim != 2:
        return _vector(archive, key, "iufc")
    if stored.shape[1] != num_antennas or stored.dtype.kind not in "iufc":
        raise InputError(
            f"{key} has shape {stored.shape} and type {stored.dtype}; it must be numbers, one for "
            f"each of {num_antennas} antennas in a row."
        )
    _require_finite(key, stored)
    return stored


def _angles(archive: Archive, key: str, count: int | None = None) -> FloatArray | None:
    if key not in archive:
        return None
    angles = _vector(archive, key, "iuf").astype(np.float64)
    if count is not None and len(angles) != count:
        raise InputError(f"{key} has {len(angles)} entries; it must have {count}, one per object.")
    return frozen(angles)


def _groups(archive: Archive, count: int) -> IntArray | None:
    """Read which extended objects the objects are of; None where the file does not say."""
    if "truth_group" not in archive:
        return None
    groups = _vector(archive, "truth_group", "iu").astype(np.int64)
    if len(groups) != count or groups.min(initial=0) < -1:
        raise InputError(
            f"truth_group has {len(groups)} entries from {groups.min(initial=0)} on; it must have "
            f"{count}, one per object, from -1 on."
        )
    return frozen(groups)


def _signal(archive: Archive, key: str, shape: tuple[int, ...], beat_sign: int) -> ComplexArray:
    signal = archive.array(key)
    shapes = [shape, shape[1:]] if len(shape) == 2 and shape[0] == 1 else [shape]
    if signal.dtype.kind not in "iufc" or signal.shape not in shapes:
        raise InputError(
            f"{key} has shape {signal.shape} and type {signal.dtype}; it must be that of received, "
            f"{shape}."
        )
    _require_finite(key, signal)
    converted = signal.astype(np.complex128).reshape(shape)
    return converted if beat_sign == -1 else np.conj(converted)


def _require_finite(key: str, array: NDArray[Any]) -> None:
    if not np.isfinite(array).all():
        raise InputError(f"{key} holds NaN or infinity; all its numbers must be finite.")
