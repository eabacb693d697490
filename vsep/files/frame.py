"""Frame files: one received frame with what must be known to take it apart.

An ``.npz`` archive without pickles. ``received`` is complex, (ramps, samples), (samples,) for a
single ramp, or (antennas, ramps, samples); the scalars ``sample_rate_hz``, ``slope_hz_per_s``,
``start_frequency_hz`` and ``ramp_period_s`` are needed. Optional: ``beat_sign``, -1 (the paper's
sign, by default) or +1 for sensors whose targets lie at positive beat frequency; ``lowest_beat``
and ``range_migration``, 1 where it is modelled, ``start_times_s`` and ``start_frequencies_hz`` of
dithered ramps, see `ChirpSequence`;
``antenna_spacing_wavelengths`` of a uniform line of antennas, and how many ``num_transmitters``
take turns; the assumed filter, ``filter_kind``
with ``filter_cutoff_hz`` (half amplitude), ``filter_rolloff``, ``filter_order``, or
``filter_frequency_hz`` and ``filter_response``; ``missing``, boolean and of the shape of
``received``, samples that were never received; the truth of a simulation, ``truth_*``.

Signals and the filter's response keep the file's own sign; numbers such as ``truth_beat`` are in
the paper's. In memory everything has the paper's sign.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, ComplexArray, frozen
from vsep._validation import require_range
from vsep.errors import InputError
from vsep.files.archive import Archive, Source, naming, require_npz_name, source_name
from vsep.files.dithering_keys import dithering_arrays, read_dithering
from vsep.files.filter_keys import default_filter, filter_arrays, read_filter
from vsep.files.frame_checks import require_antenna, require_signal, require_usable
from vsep.files.labelled import labelled
from vsep.files.truth_keys import read_truth, read_truth_mask, truth_arrays
from vsep.files.writing import write_npz
from vsep.parameters import FILTER_PARAMETERS, SCENE_PARAMETERS
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import GroundTruth

_SPACING_RANGE = 1e-3, 1e3  # wavelengths
SETTINGS_OF_RADAR: Final = (
    "start_frequency_hz",
    "slope_hz_per_s",
    "sample_rate_hz",
    "ramp_period_s",
)
_SCENE = {each.name: each.default for each in SCENE_PARAMETERS if each.name != "interference"}
# The file has a filter to assume, of the same names.
_TRUE_FILTER = {
    f"true_{each.name}": each.default
    for each in FILTER_PARAMETERS
    if each.name.startswith("filter_")
}
_SETTINGS: dict[str, type] = {"preset": str, "doppler_division": str} | {
    name: int if isinstance(default, bool) else type(default)
    for name, default in (_SCENE | _TRUE_FILTER).items()
}


@dataclass(frozen=True, kw_only=True, slots=True, weakref_slot=True, eq=False)
class Frame:
    """A received frame and what is known about it.

    Parameters
    ----------
    received : (P, N) complex
        In the paper's sign; of several antennas one.
    radar : ChirpSequence
        The victim radar.
    anti_aliasing_filter : AntiAliasingFilter or None
        The filter that an estimator should assume; None where the file names none.
    truth : GroundTruth or None
        Known for simulated frames only.
    name : str
        What to call it, usually the name of its file.
    beat_sign : int
        Sign of a target's beat frequency in the file: -1, the paper's, or +1.
    is_vector : bool
        Whether the file keeps its single ramp as a vector.
    settings : mapping of str to str
        How it was simulated, where known: preset, and settings by their names in
        `vsep.parameters`, in its units; those of the true filter after "true_".
    truth_mask : (P, N) bool or None
        Which samples are interfered, where the file says so.
    antennas : (A, P, N) complex or None
        Everything received, in the paper's sign; None where there is one antenna.
    antenna : int
        Which of the antennas `received` belongs to.
    antenna_spacing_wavelengths : float or None
        Between neighbours of a uniform line of antennas, where the file says so.
    antennas_truth : GroundTruth or None
        The truth of all antennas, where it is known; `truth` is that of the one in use.
    missing : (A, P, N) bool or None
        Which samples of each antenna were never received.
    num_transmitters : int
        How many take turns, ramp by ramp; each has antennas of its own, one after the other.

    Raises
    ------
    InputError
        If the signal is unusable or does not fit the radar.
    """

    received: ComplexArray
    radar: ChirpSequence
    anti_aliasing_filter: AntiAliasingFilter | None = None
    truth: GroundTruth | None = None
    name: str = "frame"
    beat_sign: int = -1
    is_vector: bool = False
    settings: Mapping[str, str] = field(default_factory=dict)
    truth_mask: BoolArray | None = None
    antennas: ComplexArray | None = None
    antenna: int = 0
    antenna_spacing_wavelengths: float | None = None
    antennas_truth: GroundTruth | None = None
    missing: BoolArray | None = None
    num_transmitters: int = 1

    def __post_init__(self) -> None:
        """Check the signal and freeze it."""
        if np.shape(self.received) != self.radar.shape:
            raise InputError(
                f"{self.name}: received has shape {np.shape(self.received)}; the radar's is "
                f"{self.radar.shape} (ramps, samples)."
            )
        if self.beat_sign not in (-1, 1):
            raise InputError(
                f"{self.name}: beat_sign is {self.beat_sign}; it must be -1 (the paper's) or +1."
            )
        if self.is_vector and self.radar.num_ramps != 1:
            raise InputError(f"{self.name}: a vector holds one ramp, not {self.radar.num_ramps}.")
        received = np.asarray(self.received, dtype=np.complex128)
        require_usable(self.name, received)
        object.__setattr__(self, "received", frozen(received))
        if self.antenna_spacing_wavelengths is not None:
            lowest, highest = _SPACING_RANGE
            key = f"{self.name}: antenna_spacing_wavelengths"
            require_range(key, self.antenna_spacing_wavelengths, lowest, highest)
        if self.antennas is not None:
            self._freeze_antennas(self.antennas)
        if self.missing is not None:
            self._freeze_missing(self.missing)
        require_range(f"{self.name}: num_transmitters", self.num_transmitters, 1, self.num_antennas)
        of_all = self.antennas_truth
        if of_all is not None and of_all.object_signal.shape[:-2] != (self.num_antennas,):
            raise InputError(
                f"{self.name}: antennas_truth is that of {of_all.object_signal.shape[:-2]} "
                f"antennas; the frame has {self.num_antennas}."
            )

    def _freeze_antennas(self, antennas: ComplexArray) -> None:
        """Check all antennas as the one in use was checked."""
        antennas = np.asarray(antennas, dtype=np.complex128)
        if antennas.shape != (self.num_antennas, *self.radar.shape):
            raise InputError(
                f"{self.name}: antennas have shape {antennas.shape}; the radar's is "
                f"{self.radar.shape} (ramps, samples) for each."
            )
        require_antenna(self.name, self.antenna, self.num_antennas)
        for signal in antennas:
            require_usable(self.name, signal)
        if not np.array_equal(antennas[self.antenna], self.received):
            raise InputError(f"{self.name}: received is not the signal of antenna {self.antenna}.")
        object.__setattr__(self, "antennas", frozen(antennas))

    def _freeze_missing(self, missing: BoolArray) -> None:
        """Check which samples are missing; all of them would leave no signal."""
        missing = np.array(missing)
        shape = (self.num_antennas, *self.radar.shape)
        if missing.shape != shape or missing.dtype != np.bool_ or missing.all():
            raise InputError(
                f"{self.name}: missing has shape {missing.shape} and type {missing.dtype}; it must "
                f"be boolean, {shape}, and not true everywhere."
            )
        object.__setattr__(self, "missing", frozen(missing))

    @property
    def num_antennas(self) -> int:
        """Number of receive antennas, virtual ones included."""
        return 1 if self.antennas is None else len(self.antennas)

    def of_antenna(self, antenna: int) -> "Frame":
        """Return the frame of one antenna alone, with its truth where that of all is known.

        Raises
        ------
        InputError
            If there is no such antenna.
        """
        require_antenna(self.name, antenna, self.num_antennas)
        if self.antennas is None:
            return self
        of_all = self.antennas_truth
        return replace(
            self,
            received=self.antennas[antenna],
            truth=self.truth if of_all is None else of_all.of_antenna(antenna),
            antennas=None,
            antenna=0,
            antenna_spacing_wavelengths=None,
            antennas_truth=None,
            missing=None if self.missing is None else _missing_of(self.missing, antenna),
            num_transmitters=1,
        )

    def missing_rows(self, *, together: bool) -> BoolArray | None:
        """(P, N) missing samples of the antenna in use, or (A, P, N) of all of them together."""
        if self.missing is None or together:
            return self.missing
        found = _missing_of(self.missing, self.antenna)
        return None if found is None else found[0]

    @property
    def assumed_filter(self) -> AntiAliasingFilter:
        """The file's filter, or the default one: raised cosine, a quarter of the sample rate."""
        return self.anti_aliasing_filter or default_filter(self.radar.sample_rate_hz)

    @property
    def perfect_mask(self) -> BoolArray | None:
        """(P, N) interfered samples: the file's own mask, else by its truth, else None."""
        if self.truth_mask is not None:
            return self.truth_mask
        return None if self.truth is None else self.truth.perfect_mask()

    def to_xarray(self) -> Any:
        """Return the samples with their labels.

        Returns
        -------
        xarray.DataArray
            (antenna, ramp, sample) complex in the sign of the file, with `ramp_start_s`,
            `sample_time_s` and, where there are such, `missing` as coordinates and the radar's
            values as attributes.

        Raises
        ------
        InputError
            If xarray is missing; the sentence says what to install.
        """
        signal = self.received[None] if self.antennas is None else self.antennas
        more = {
            "beat_sign": self.beat_sign,
            "antenna_spacing_wavelengths": self.antenna_spacing_wavelengths,
        }
        in_sign = np.conj(signal) if self.beat_sign == 1 else np.array(signal)
        return labelled(self.name, in_sign, self.radar, self.missing, more)

    def in_file_sign(self, signal: ComplexArray) -> ComplexArray:
        """Turn a (P, N) signal of the paper's sign into the sign and shape of the file."""
        return self.in_file_shape(signal if self.beat_sign == -1 else np.conj(signal))

    def in_file_shape(self, samples: NDArray[Any]) -> NDArray[Any]:
        """Turn (P, N) samples into the shape of the file's."""
        return samples[0] if self.is_vector else samples


def read_frame(source: Source, *, name: str | None = None, antenna: int = 0) -> Frame:
    """Read a frame file.

    Parameters
    ----------
    source : str, Path or binary file
        An ``.npz`` archive as the module describes; unknown arrays are ignored.
    name : str, optional
        What to call it; the path by default.
    antenna : int
        Which antenna the frame's `received` is, where the file holds several.

    Raises
    ------
    InputError
        In one sentence, whatever is wrong with the file.
    """
    label = source_name(source, name)
    with Archive(source, label) as archive:
        stored = archive.array("received")
        require_signal(label, stored)
        every = stored.reshape((1, 1, *stored.shape)[-3:])
        require_antenna(label, antenna, len(every))
        try:
            radar = _read_radar(archive, every.shape[1:])
            beat_sign = archive.beat_sign()
            anti_aliasing_filter = read_filter(archive, beat_sign)
            truth = read_truth(archive, radar.shape, beat_sign, len(every))
            truth_mask = read_truth_mask(archive, radar.shape)
            missing = archive.array("missing") if "missing" in archive else None
            spacing = _read_spacing(archive)
            transmitters = archive.whole_number("num_transmitters", 1)
        except InputError as error:
            raise naming(label, error) from error
        antennas = _in_paper_sign(every, beat_sign)
        of_all = truth if truth is not None and truth.amplitudes.ndim == 2 else None
        return Frame(
            received=antennas[antenna],
            radar=radar,
            anti_aliasing_filter=anti_aliasing_filter,
            truth=truth if of_all is None else of_all.of_antenna(antenna),
            name=label,
            beat_sign=beat_sign,
            is_vector=stored.ndim == 1,
            settings=_read_settings(archive),
            truth_mask=truth_mask,
            antennas=antennas if stored.ndim == 3 else None,
            antenna=antenna,
            antenna_spacing_wavelengths=spacing,
            antennas_truth=of_all,
            missing=None if missing is None else missing.reshape((1, 1, *missing.shape)[-3:]),
            num_transmitters=transmitters,
        )


def write_frame(path: str | Path, frame: Frame) -> None:
    """Write a frame file; the same frame always gives the same bytes.

    Parameters
    ----------
    path : str or Path
        Must end in ``.npz``; its folder must exist.
    frame : Frame
        What to write.

    Raises
    ------
    InputError
        If the name is not an ``.npz`` one.
    OSError
        If the file cannot be written.
    """
    require_npz_name(path, "a frame file")
    radar = frame.radar
    signal = frame.received if frame.antennas is None else frame.antennas
    arrays: dict[str, Any] = {
        "received": frame.in_file_sign(signal),
        "sample_rate_hz": radar.sample_rate_hz,
        "slope_hz_per_s": radar.slope_hz_per_s,
        "start_frequency_hz": radar.start_frequency_hz,
        "ramp_period_s": radar.ramp_period_s,
        "lowest_beat": radar.lowest_beat,
        "beat_sign": frame.beat_sign,
    }
    if radar.range_migration:
        arrays["range_migration"] = 1
    arrays |= dithering_arrays(radar)
    if frame.num_transmitters > 1:
        arrays["num_transmitters"] = frame.num_transmitters
    if frame.antenna_spacing_wavelengths is not None:
        arrays["antenna_spacing_wavelengths"] = frame.antenna_spacing_wavelengths
    if frame.anti_aliasing_filter is not None:
        arrays |= filter_arrays(frame.anti_aliasing_filter, frame.beat_sign)
    truth = frame.antennas_truth or frame.truth
    if truth is not None:
        arrays |= truth_arrays(truth, frame.in_file_sign)
    if frame.truth_mask is not None:
        arrays["truth_mask"] = frame.in_file_shape(frame.truth_mask)
    if frame.missing is not None:
        arrays["missing"] = frame.missing.reshape(arrays["received"].shape)
    arrays |= {
        key: kind(frame.settings[key]) for key, kind in _SETTINGS.items() if key in frame.settings
    }
    write_npz(path, **arrays)


def _missing_of(missing: BoolArray, antenna: int) -> BoolArray | None:
    """Return the missing samples of one antenna, None where none or all are."""
    if not missing[antenna].any() or missing[antenna].all():
        return None
    return missing[antenna : antenna + 1]


def _read_radar(archive: Archive, shape: tuple[int, ...]) -> ChirpSequence:
    values: dict[str, Any] = {key: archive.number(key) for key in SETTINGS_OF_RADAR}
    return ChirpSequence(
        **values | read_dithering(archive),
        num_ramps=shape[0],
        num_samples=shape[1],
        lowest_beat=archive.number("lowest_beat", -0.5),
        range_migration=archive.whole_number("range_migration", 0) != 0,
    )


def _read_spacing(archive: Archive) -> float | None:
    key = "antenna_spacing_wavelengths"
    return archive.number(key) if key in archive else None


def _read_settings(archive: Archive) -> dict[str, str]:
    readers: dict[type, Callable[[str], object]] = {
        str: archive.text,
        float: archive.number,
        int: archive.whole_number,
    }
    return {key: str(readers[kind](key)) for key, kind in _SETTINGS.items() if key in archive}


def _in_paper_sign(signal: NDArray[Any], beat_sign: int) -> ComplexArray:
    converted = signal.astype(np.complex128)
    return converted if beat_sign == -1 else np.conj(converted)
