"""The part of a picture that stays while a run goes on: axes, limits, the frame as received, truth.

Levels are in dB over the median power of the received samples, so that they do not depend on the
unit of the samples. All limits are computed once a scene, so that no axis jumps while it runs.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.inference.core.state import SeparationState
from vsep.signal.doppler_division import DopplerDivision
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import GroundTruth, Observation
from vsep.signal.spectra import delay_spectrum, range_doppler_map
from vsep.units import to_db

MIN_LEVEL_DB = -200.0
ZERO_PADDING = 4
MAP_PADDING = 2
QUIET_SHARE = 0.2  # of the ramps: so many are free of bursts in most recordings

ByteArray: TypeAlias = NDArray[np.uint8]
Limits: TypeAlias = tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueObjects:
    """Where the objects truly are, in display units; empty where it is not known."""

    #: (L,) float: Positions, velocity positive for a receding object.
    ranges_m: FloatArray
    velocities_mps: FloatArray
    levels_db: FloatArray  #: (L,) float: Peak of each object in the delay spectrum of one ramp.
    snr_db: FloatArray  #: (L,) float: Component SNR in dB.
    angles_deg: FloatArray | None = None  #: (L,) float: Directions, where they are known.


@dataclass(frozen=True, kw_only=True)
class ShownAntenna:
    """Which antenna pictures show, and with how many it is separated."""

    number: int = 0  #: The antenna, from 0.
    together: int = 1  #: Antennas that are separated together; 1: this one alone.
    #: Between neighbours of a uniform line of antennas; None: not known, no angles.
    spacing_wavelengths: float | None = None
    num_transmitters: int = 1  #: Transmitters that take turns.
    division: DopplerDivision | None = None  #: Transmitters that send in every ramp.


THE_ONLY_ANTENNA = ShownAntenna()


@dataclass(frozen=True, kw_only=True, eq=False)
class StaticPicture:
    """What all pictures of one run share."""

    radar: ChirpSequence  #: For the conversion to display units.
    observation: Observation  #: The frame and, where known, its truth.
    reference_power: float  #: Power of 0 dB.
    times_us: FloatArray  #: (N,) float: Fast time.
    ranges_m: FloatArray  #: (M,) float: Range axis of the delay spectra, ascending.
    #: (Mn,), (Mp,) float: Axes of the maps, ascending.
    map_ranges_m: FloatArray
    map_velocities_mps: FloatArray
    #: (Mp, Mn) uint8: Range-Doppler map of the received frame; 0 and 255 are the ends of
    #: `map_limits_db`.
    map_before: ByteArray
    #: (float, float): Fixed limits of the axes.
    level_limits_db: Limits
    real_limits: Limits
    spectrum_limits_db: Limits
    map_limits_db: Limits
    true_objects: TrueObjects  #: Truth in display units.
    true_ramps: BoolArray  #: (P,) bool: Ramps in which a burst truly crosses.
    #: (float, float): Part of the axes that holds all true objects, where they are known and there
    #: are several ramps; else all of the range axis, and an empty tuple.
    shown_ranges_m: Limits
    shown_velocities_mps: Limits | tuple[()]
    band_hz: float  #: Half-width of the pass band, at most half of the sampling rate.
    title: str  #: The scene in a few words.
    levels_text: str  #: SNR and SIR in both conventions.
    antenna: ShownAntenna = THE_ONLY_ANTENNA  #: Whose frame it is.

    @property
    def range_limits_m(self) -> Limits:
        """Ends of the range axis."""
        return float(self.ranges_m[0]), float(self.ranges_m[-1])

    def seen(self, state: SeparationState) -> SeparationState:
        """Return what a state says of the antenna shown."""
        if self.antenna.together == 1:
            return state
        return state.of_antenna(self.antenna.number, self.antenna.together)

    def level_db(self, power: FloatArray) -> FloatArray:
        """Level of a power over the reference, floored at -200 dB."""
        levels: FloatArray = np.maximum(to_db(power / self.reference_power), MIN_LEVEL_DB)
        return levels

    def spectra_db(self, signals: ComplexArray) -> FloatArray:
        """Levels of the delay spectra of (..., N) signals on `ranges_m`."""
        return self.level_db(_delay_power(self.radar, signals)[1])

    def map_of(self, signal: ComplexArray) -> ByteArray:
        """Range-Doppler map of a (P, N) signal, scaled like `map_before`."""
        return _quantised(self.level_db(_map_power(self.radar, signal)[2]), self.map_limits_db)


def make_static_picture(
    radar: ChirpSequence,
    observation: Observation,
    *,
    title: str,
    antenna: ShownAntenna = THE_ONLY_ANTENNA,
    cutoff_hz: float | None = None,
) -> StaticPicture:
    """Compute axes, limits and truth of a scene.

    The observation is the frame of one antenna, with truth where it is known; the title says the
    scene in a few words, `antenna` whose frame it is, `cutoff_hz` where its filter passes half of
    the amplitude, by default a quarter of the sampling rate.
    """
    nyquist_hz = radar.sample_rate_hz / 2.0
    received, truth = observation.received, observation.truth
    power = np.abs(received) ** 2
    reference = float(np.median(power)) or float(np.mean(power))
    without_bursts = received - truth.interference_signal if truth is not None else received
    ranges, spectrum = _delay_power(radar, received)
    spectra = [to_db(spectrum / reference)]
    spectra.append(to_db(_delay_power(radar, without_bursts)[1] / reference))
    map_ranges, map_velocities, before = _map_power(radar, received)
    clean_map = to_db(_map_power(radar, without_bursts)[2] / reference)
    before_db = to_db(before / reference)
    floor_db = float(np.median(clean_map))
    if truth is None:
        floor_db = min(floor_db, _quiet_floor_db(spectrum, reference))
    map_limits = _limits(floor_db - 2.0, float(clean_map.max()) + 3.0, 30.0)
    peak = float(np.max(np.abs(received.real)))
    true_objects = _true_objects(radar, truth, reference)
    shown_ranges, shown_velocities = _shown(ranges, true_objects, several=radar.num_ramps > 1)
    return StaticPicture(
        radar=radar,
        observation=observation,
        reference_power=reference,
        times_us=radar.sample_times_s * 1e6,
        ranges_m=ranges,
        map_ranges_m=map_ranges,
        map_velocities_mps=map_velocities,
        map_before=_quantised(before_db, map_limits),
        level_limits_db=_limits(-30.0, float(to_db(power.max() / reference)) + 6.0, 40.0),
        real_limits=(-1.08 * peak, 1.08 * peak),
        spectrum_limits_db=_limits(
            float(np.percentile(spectra[1], 10)) - 8.0,
            max(float(s.max()) for s in spectra) + 6.0,
            40.0,
        ),
        map_limits_db=map_limits,
        true_objects=true_objects,
        shown_ranges_m=shown_ranges,
        shown_velocities_mps=shown_velocities,
        true_ramps=_true_ramps(radar, truth),
        band_hz=min(nyquist_hz / 2.0 if cutoff_hz is None else cutoff_hz, nyquist_hz),
        title=title,
        levels_text=_levels_text(radar, truth),
        antenna=antenna,
    )


def _quiet_floor_db(spectrum: FloatArray, reference: float) -> float:
    """Level of the noise in the ramps that no burst crosses, where nobody says which these are.

    A bin of noise is exponentially distributed: this share of the ramps lies below -log(1 - share)
    times its mean. Objects hold few of the bins, which the median leaves out.
    """
    quiet = np.quantile(spectrum, QUIET_SHARE, axis=0) / -np.log1p(-QUIET_SHARE)
    return float(to_db(np.median(quiet) / reference))


def _shown(
    ranges_m: FloatArray, true_objects: TrueObjects, *, several: bool
) -> tuple[Limits, Limits | tuple[()]]:
    """Limits around all true objects, in steps of 10 m and 5 m/s so that seeds share them."""
    full = (float(ranges_m[0]), float(ranges_m[-1]))
    if not several or not true_objects.ranges_m.size:
        return full, ()
    farthest = 10.0 * float(np.ceil(1.2 * np.max(np.abs(true_objects.ranges_m)) / 10.0))
    fastest = 5.0 * float(np.ceil(1.3 * np.max(np.abs(true_objects.velocities_mps)) / 5.0)) + 5.0
    return (max(full[0], -0.2 * farthest), min(full[1], farthest)), (-fastest, fastest)


def _limits(lowest: float, highest: float, least_span: float) -> Limits:
    lowest, highest = 5.0 * np.floor(lowest / 5.0), 5.0 * np.ceil(highest / 5.0)
    return float(lowest), float(max(highest, lowest + least_span))


def _quantised(levels_db: FloatArray, limits: Limits) -> ByteArray:
    lowest, highest = limits
    scaled = np.clip((levels_db - lowest) / (highest - lowest), 0.0, 1.0) * 255.0
    return np.asarray(np.round(scaled), dtype=np.uint8)


def _delay_power(radar: ChirpSequence, signals: ComplexArray) -> tuple[FloatArray, FloatArray]:
    beats, power = delay_spectrum(signals, zero_padding=ZERO_PADDING, lowest_beat=radar.lowest_beat)
    ranges = radar.range_from_beat(beats)
    order = np.argsort(ranges)
    return ranges[order], power[..., order]


def _map_power(
    radar: ChirpSequence, signal: ComplexArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    dopplers, beats, power = range_doppler_map(
        signal,
        zero_padding=MAP_PADDING,
        lowest_beat=radar.lowest_beat,
        migration=radar.migration,
    )
    ranges = radar.range_from_beat(beats)
    order = np.argsort(ranges)
    return ranges[order], radar.velocity_from_doppler(dopplers), power[:, order]


def _true_objects(radar: ChirpSequence, truth: GroundTruth | None, reference: float) -> TrueObjects:
    if truth is None:
        empty = np.zeros(0)
        return TrueObjects(ranges_m=empty, velocities_mps=empty, levels_db=empty, snr_db=empty)
    power = np.abs(truth.amplitudes) ** 2
    return TrueObjects(
        ranges_m=radar.range_from_beat(truth.beats),
        velocities_mps=radar.velocity_from_doppler(truth.dopplers),
        levels_db=to_db(power / (radar.num_ramps * reference)),
        snr_db=to_db(power * truth.noise_precision),
        angles_deg=truth.angles_deg,
    )


def _true_ramps(radar: ChirpSequence, truth: GroundTruth | None) -> BoolArray:
    mask = np.zeros(radar.num_ramps, dtype=np.bool_)
    if truth is not None:
        mask[[burst.ramp for burst in truth.bursts]] = True
    return mask


def _levels_text(radar: ChirpSequence, truth: GroundTruth | None) -> str:
    """Both conventions of SNR and SIR; what is not known, or has no meaning, is left out."""
    if truth is None or not np.any(truth.object_signal):
        return ""
    parts = []
    energy = float(np.sum(np.abs(truth.object_signal) ** 2))
    if np.isfinite(truth.noise_precision):
        snr_db = to_db(energy * truth.noise_precision)
        per_sample_db = snr_db - to_db(radar.num_ramps * radar.num_samples)
        parts.append(f"SNR {snr_db:.1f} dB in total ({per_sample_db:.1f} dB per sample)")
    burst_energy = float(np.sum(np.abs(truth.interference_signal) ** 2))
    if burst_energy > 0.0:
        share = float(np.mean(truth.interfered_samples()))
        sir_db = round(float(to_db(energy / burst_energy)), 6) + 0.0  # no minus before a zero
        parts.append(
            f"SIR {sir_db:.1f} dB in total ({sir_db + to_db(share):.1f} dB inside the bursts, "
            f"{100.0 * share:.0f} % of the samples)"
        )
    return "; ".join(parts)
