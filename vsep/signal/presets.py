"""The scenes of Table I: Simulation I and the three parameter sets of Simulation II.

Left open by the paper and chosen here: the anti-aliasing filter of Simulation II (that of
Simulation I, a raised cosine of half amplitude at a quarter of the sampling rate and roll-off
0.25), the time offset of the interferer (zero, with which every burst crosses the band near the
middle of its ramp) and the Doppler frequencies of the interference paths (zero).
"""

from dataclasses import dataclass, replace
from typing import TypedDict, Unpack

import numpy as np

from vsep._arrays import ComplexArray, InputError, require_range
from vsep.signal.filters import AntiAliasingFilter, RaisedCosineFilter
from vsep.signal.motion import CYCLE_S, moved_paths
from vsep.signal.preset_names import PRESET_NAMES
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer, Observation, Scene
from vsep.signal.simulate import InterferenceModel, simulate

_SIMULATION_1_RADAR = ChirpSequence(
    start_frequency_hz=79e9,
    slope_hz_per_s=1e13,
    sample_rate_hz=10.2e6,
    ramp_period_s=25e-6,
    num_samples=256,
    num_ramps=1,
)
_SIMULATION_2_RADAR = ChirpSequence(
    start_frequency_hz=79e9,
    slope_hz_per_s=1e13,
    sample_rate_hz=5.1e6,
    ramp_period_s=25e-6,
    num_samples=128,
    num_ramps=16,
)
_INTERFERERS = {
    "simulation-1": InterfererSequence(
        start_frequency_hz=79.01e9,
        slope_hz_per_s=9.2e12,
        ramp_duration_s=25e-6,
        ramp_period_s=25e-6,
        num_ramps=1,
    ),
    "simulation-2-a": InterfererSequence(
        start_frequency_hz=79.002e9,
        slope_hz_per_s=9.8321e12,
        ramp_duration_s=25.02e-6,
        ramp_period_s=75.01e-6,
        num_ramps=2,
    ),
    "simulation-2-b": InterfererSequence(
        start_frequency_hz=79.004e9,
        slope_hz_per_s=9.7122e12,
        ramp_duration_s=25.02e-6,
        ramp_period_s=50.01e-6,
        num_ramps=4,
    ),
    "simulation-2-c": InterfererSequence(
        start_frequency_hz=79.008e9,
        slope_hz_per_s=9.3925e12,
        ramp_duration_s=25.02e-6,
        ramp_period_s=25.02e-6,
        num_ramps=8,
    ),
}
_SIMULATION_1_DELAY_S = 80.06e-9
_PERIOD_DIFFERENCE_S = 10e-9  # of an interferer in every ramp; that of set a in one of its ramps
_NUM_PATHS = 10
_DELAY_RANGE_S = (3.97e-9, 127e-9)
_DOPPLER_RANGE_HZ = (-5e3, 5e3)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scenario:
    """A radar, what is in front of it, and its anti-aliasing filter."""

    radar: ChirpSequence
    scene: Scene
    anti_aliasing_filter: AntiAliasingFilter


class PresetOptions(TypedDict, total=False):
    """Optional keywords of `preset` that `simulate_preset` hands on."""

    interference: bool
    interferer_slope_hz_per_s: float | None
    time_offset_s: float
    num_interfered_ramps: int | None


def preset(
    name: str,
    *,
    snr_db: float,
    sir_db: float,
    rng: np.random.Generator,
    interference: bool = True,
    interferer_slope_hz_per_s: float | None = None,
    time_offset_s: float = 0.0,
    num_interfered_ramps: int | None = None,
) -> Scenario:
    """Draw a scene of Table I.

    Objects and interference come from two children of `rng`, so that the same objects appear with
    and without interference.

    Parameters
    ----------
    name : str
        One of `PRESET_NAMES`.
    snr_db, sir_db : float
        (25) and (26), ratios of total energies.
    rng : numpy.random.Generator
        Spawns the two streams.
    interference : bool
        Whether there is an interferer.
    interferer_slope_hz_per_s : float, optional
        Another slope k_I. The interferer's start frequency follows, so that its first ramp crosses
        the band at the same time as with the slope of Table I.
    time_offset_s : float
        T-bar; a microsecond shifts the course by k_I times a microsecond, some 10 MHz.
    num_interfered_ramps : int, optional
        That many ramps in a row, from the first on, are interfered.

    Returns
    -------
    Scenario

    Raises
    ------
    InputError
        If the name is unknown or a number out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(1)
    >>> scenario = preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, rng=rng)
    >>> scenario.radar.shape, scenario.scene.objects.num_paths
    ((16, 128), 10)
    """
    sequence = interferer_sequence(
        name,
        slope_hz_per_s=interferer_slope_hz_per_s,
        time_offset_s=time_offset_s,
        num_interfered_ramps=num_interfered_ramps,
    )
    radar = preset_radar(name)
    object_rng, channel_rng = rng.spawn(2)
    single = name == "simulation-1"
    objects = _single_path(object_rng, _SIMULATION_1_DELAY_S) if single else _objects(object_rng)
    channel = _single_path(channel_rng, 0.0) if single else _interference_paths(channel_rng)
    interferers = (Interferer(sequence=sequence, channel=channel),) if interference else ()
    return Scenario(
        radar=radar,
        scene=Scene(objects=objects, interferers=interferers, snr_db=snr_db, sir_db=sir_db),
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=radar.sample_rate_hz / 4.0, rolloff=0.25),
    )


def simulate_preset(
    name: str,
    *,
    snr_db: float,
    sir_db: float,
    seed: int | np.random.SeedSequence,
    anti_aliasing_filter: AntiAliasingFilter | None = None,
    interference_model: InterferenceModel = "multiplicative",
    frame_number: int = 0,
    **options: Unpack[PresetOptions],
) -> tuple[Scenario, Observation]:
    """Draw a scene of Table I and simulate its frame, both from one seed.

    Scene and noise come from two children of the seed: the noise is the same with and without
    interference, whatever the levels.

    Parameters
    ----------
    name, snr_db, sir_db
        As for `preset`.
    seed : int or numpy.random.SeedSequence
        Not negative.
    anti_aliasing_filter : AntiAliasingFilter, optional
        Shapes the bursts in the place of the preset's filter.
    interference_model : str
        As for `simulate`.
    frame_number : int
        Which frame of a sequence with one every `CYCLE_S`: objects have moved on, the noise is
        another one, the bursts stay where they are.
    **options : PresetOptions
        As for `preset`.

    Returns
    -------
    Scenario
        With the filter that was used.
    Observation
        The frame and its truth.

    Raises
    ------
    InputError
        If the name is unknown or a number out of its range.
    """
    if isinstance(seed, np.random.SeedSequence):
        # A fresh copy: spawning counts children, and the same seed must give the same frame.
        sequence = np.random.SeedSequence(seed.entropy, spawn_key=seed.spawn_key)
    else:
        require_range("seed", seed, 0, 2**63 - 1)
        sequence = np.random.SeedSequence(seed)
    require_range("frame_number", frame_number, 0, 1_000_000)
    scene_seed, *noise_seeds = sequence.spawn(2 + frame_number)
    drawn = preset(
        name,
        snr_db=snr_db,
        sir_db=sir_db,
        rng=np.random.default_rng(scene_seed),
        **options,
    )
    used = drawn.anti_aliasing_filter if anti_aliasing_filter is None else anti_aliasing_filter
    objects = moved_paths(drawn.radar, drawn.scene.objects, frame_number * CYCLE_S)
    scene = replace(drawn.scene, objects=objects)
    scenario = Scenario(radar=drawn.radar, scene=scene, anti_aliasing_filter=used)
    observation = simulate(
        scenario.radar,
        scenario.scene,
        anti_aliasing_filter=used,
        interference_model=interference_model,
        rng=np.random.default_rng(noise_seeds[-1]),
    )
    return scenario, observation


def preset_radar(name: str) -> ChirpSequence:
    """Return the victim radar of a preset; `InputError` for an unknown name."""
    _require_name(name)
    return _SIMULATION_1_RADAR if name == "simulation-1" else _SIMULATION_2_RADAR


def interferer_sequence(
    name: str,
    *,
    slope_hz_per_s: float | None = None,
    time_offset_s: float = 0.0,
    num_interfered_ramps: int | None = None,
) -> InterfererSequence:
    """Return the interferer of a preset, with another slope or time offset if wanted.

    Parameters
    ----------
    name : str
        One of `PRESET_NAMES`.
    slope_hz_per_s : float, optional
        k_I, not that of the victim; the start frequency follows so that the first ramp crosses
        zero intermediate frequency at the same fast time as with the preset's own slope.
    time_offset_s : float
        T-bar, start of the interferer's first ramp.
    num_interfered_ramps : int, optional
        P_I, with a ramp period so near the victim's that every ramp meets one of the victim's; its
        crossing moves by at most 0.6 us from ramp to ramp, as the slopes of Table I are.

    Returns
    -------
    InterfererSequence

    Raises
    ------
    InputError
        If the name is unknown or a number out of its range.
    """
    _require_name(name)
    own = _INTERFERERS[name]
    slope = own.slope_hz_per_s if slope_hz_per_s is None else slope_hz_per_s
    radar = preset_radar(name)
    carrier = own.start_frequency_hz - radar.start_frequency_hz
    crossing_s = -carrier / (own.slope_hz_per_s - radar.slope_hz_per_s)
    moved = (own.slope_hz_per_s - slope) * crossing_s
    sequence = replace(
        own,
        start_frequency_hz=own.start_frequency_hz + moved,
        slope_hz_per_s=slope,
        time_offset_s=time_offset_s,
    )
    if num_interfered_ramps is None:
        return sequence
    require_range("num_interfered_ramps", num_interfered_ramps, 1, radar.num_ramps)
    period_s = radar.ramp_period_s + _PERIOD_DIFFERENCE_S
    return replace(
        sequence, ramp_duration_s=period_s, ramp_period_s=period_s, num_ramps=num_interfered_ramps
    )


def _require_name(name: str) -> None:
    if name not in PRESET_NAMES:
        allowed = ", ".join(PRESET_NAMES)
        raise InputError(f"The preset is {name!r}; it must be one of {allowed}.")


def _single_path(rng: np.random.Generator, delay_s: float) -> Channel:
    """One path of unit weight and random phase."""
    return Channel(delays_s=np.array([delay_s]), dopplers_hz=np.zeros(1), weights=_phases(rng, 1))


def _objects(rng: np.random.Generator) -> Channel:
    """Objects of Simulation II: level -40 log10(tau c_0 + 1) dB, give or take 3 dB."""
    delays_s = rng.uniform(*_DELAY_RANGE_S, _NUM_PATHS)
    dopplers_hz = rng.uniform(*_DOPPLER_RANGE_HZ, _NUM_PATHS)
    level_db = -40.0 * np.log10(delays_s * SPEED_OF_LIGHT_MPS + 1.0)
    level_db += rng.uniform(-3.0, 3.0, _NUM_PATHS)
    weights = 10.0 ** (level_db / 20.0) * _phases(rng, _NUM_PATHS)
    return Channel(delays_s=delays_s, dopplers_hz=dopplers_hz, weights=weights)


def _interference_paths(rng: np.random.Generator) -> Channel:
    """Interference paths of Simulation II; the first is direct, with delay 0 and magnitude 1."""
    delays_s = rng.uniform(*_DELAY_RANGE_S, _NUM_PATHS)
    level_db = rng.uniform(-10.0, 0.0, _NUM_PATHS)
    delays_s[0] = level_db[0] = 0.0
    level_db -= 20.0 * np.log10(delays_s * SPEED_OF_LIGHT_MPS + 1.0)
    weights = 10.0 ** (level_db / 20.0) * _phases(rng, _NUM_PATHS)
    return Channel(delays_s=delays_s, dopplers_hz=np.zeros(_NUM_PATHS), weights=weights)


def _phases(rng: np.random.Generator, count: int) -> ComplexArray:
    return np.asarray(np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, count)))
