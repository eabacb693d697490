"""Scenes of the presets, drawn at random, and their frames.

Left open by the paper and chosen here: the anti-aliasing filter of Simulation II (that of
Simulation I, a raised cosine of half amplitude at a quarter of the sampling rate and roll-off
0.25), the time offset of the interferer (zero, with which every burst crosses the band near the
middle of its ramp) and the Doppler frequencies of the interference paths (zero).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypedDict, Unpack

import numpy as np

from vsep._validation import require_range
from vsep.parameters import PARAMETERS
from vsep.presets.cars import with_cars
from vsep.presets.channels import with_first_delay
from vsep.presets.places import Place, placed_objects
from vsep.presets.record import SimulatedPreset
from vsep.presets.registry import simulated_preset
from vsep.signal.doppler_division import divided_channel, known_division
from vsep.signal.filters import AntiAliasingFilter, RaisedCosineFilter
from vsep.signal.impairments import impairments_of
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.motion import CYCLE_S, accelerated, moved_paths
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Interferer, Observation, Scene
from vsep.signal.simulate import InterferenceModel, simulate

_SLOPE_FACTORS = (1.2, 2.0)  # of a second interferer
MAX_DEG = 60.0
"""To both sides of broadside: directions that are drawn, as far as the line tells them apart."""
_CROSSING_SHIFTS = (0.15, 0.35)  # in ramps
_PERIOD_DIFFERENCE_S = 10e-9  # of an interferer in every ramp; that of set a in one of its ramps


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scenario:
    """A radar, what is in front of it, and its anti-aliasing filter."""

    radar: ChirpSequence
    scene: Scene
    anti_aliasing_filter: AntiAliasingFilter


class PresetOptions(TypedDict, total=False):
    """Optional keywords of `preset`, which explains them; `simulate_preset` hands them on."""

    interference: bool
    interferer_slope_hz_per_s: float | None
    interferer_waveform: str
    time_offset_s: float
    burst_shift_s: float
    num_interfered_ramps: int | None
    num_objects: int | None
    num_cars: int | None
    acceleration_mps2: float | None
    doppler_division: str
    object_delay_s: float | None
    second_interferer: bool
    phase_jitter_rad: float
    phase_noise_rad: float
    phase_noise_bandwidth_hz: float
    iq_gain_db: float
    iq_phase_deg: float
    dc_offset: float
    places: Sequence[Place]


def preset(
    name: str | SimulatedPreset,
    *,
    snr_db: float,
    sir_db: float,
    rng: np.random.Generator,
    **options: Unpack[PresetOptions],
) -> Scenario:
    """Draw the scene of a preset.

    Objects and interference come from children of `rng` of their own, so that the same objects
    appear with and without interference.

    Parameters
    ----------
    name : str or SimulatedPreset
        One of `vsep.presets.registry.PRESET_NAMES`, or a record of your own.
    snr_db, sir_db : float
        (25) and (26), ratios of total energies.
    rng : numpy.random.Generator
        Spawns the two streams.
    interference : bool
        Whether there is an interferer.
    interferer_slope_hz_per_s : float, optional
        Another slope k_I. The interferer's start frequency follows, so that its first ramp crosses
        the band at the same time as with the slope of Table I.
    interferer_waveform : str
        One of `vsep.parameters.WAVEFORMS`, see `vsep.signal.transmitters`; the preset's by default.
    time_offset_s : float
        T-bar; a microsecond shifts the course by k_I times a microsecond, some 10 MHz.
    burst_shift_s : float
        Moves the crossing of zero inside the ramp by that much, by a further time offset.
    num_interfered_ramps : int, optional
        That many ramps in a row, from the first on, are interfered.
    num_objects : int, optional
        From 1 to `MAX_OBJECTS`; a scene of more objects has those of one with less.
    num_cars : int, optional
        Extended objects beside them, see `vsep.presets.cars`; the preset's by default.
    acceleration_mps2 : float, optional
        By which every object gains or loses velocity, which is that in mid-frame then; the preset's
        by default.
    doppler_division : str
        One of `vsep.parameters.DOPPLER_DIVISIONS`; the preset's by default. Every object has a line
        for each transmitter; these stand half a wavelength apart, and directions are drawn.
    object_delay_s : float, optional
        Delay of the first object, within the radar's unambiguous interval. A burst lies around
        delay zero, as far as the cut-off frequency over the victim's slope.
    second_interferer : bool
        Whether there is another interferer, see `more_interferers`.
    phase_jitter_rad, phase_noise_rad, phase_noise_bandwidth_hz, iq_gain_db, iq_phase_deg, dc_offset
        No part of the scene: `simulate_preset` makes `ReceiverImpairments` of them.
    places : sequence of Place
        Objects in the place of those that are drawn; none draws them.

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
    record = simulated_preset(name)
    sequence = interferer_sequence(
        record,
        slope_hz_per_s=options.get("interferer_slope_hz_per_s"),
        time_offset_s=options.get("time_offset_s", 0.0),
        burst_shift_s=options.get("burst_shift_s", 0.0),
        num_interfered_ramps=options.get("num_interfered_ramps"),
    )
    object_rng, channel_rng, other_rng, motion_rng, code_rng, angle_rng = rng.spawn(6)
    places = options.get("places", ())
    objects = (
        placed_objects(object_rng, record.radar, places)
        if places
        else record.draw_objects(object_rng, options.get("num_objects"))
    )
    objects = with_first_delay(objects, record.radar, options.get("object_delay_s"))
    num_cars = options.get("num_cars")
    num_cars = record.num_cars if num_cars is None else num_cars
    if num_cars:
        objects = with_cars(motion_rng, record.radar, objects, num_cars)
    acceleration_mps2 = options.get("acceleration_mps2")
    if acceleration_mps2 is None:
        acceleration_mps2 = record.acceleration_mps2
    if acceleration_mps2:
        objects = accelerated(motion_rng, record.radar, objects, acceleration_mps2)
    division = known_division(options.get("doppler_division", record.doppler_division))
    if division is not None:
        line = UniformLinearArray(num_antennas=division.num_transmitters)
        angles_deg = angle_rng.uniform(-MAX_DEG, MAX_DEG, objects.num_paths)
        objects = divided_channel(objects, record.radar, division, line.steering(angles_deg))
    present = options.get("interference", True)
    interferer = Interferer(
        sequence=sequence,
        channel=record.draw_paths(channel_rng),
        waveform=options.get("interferer_waveform", record.waveform),
        seed=int(code_rng.integers(2**31)),
    )
    interferers: tuple[Interferer, ...] = (interferer,) if present else ()
    others = record.num_interferers - 1 + bool(options.get("second_interferer", False))
    for _ in range(others if present else 0):
        interferers += more_interferers(record, interferer, other_rng)
    return Scenario(
        radar=record.radar,
        scene=Scene(objects=objects, interferers=interferers, snr_db=snr_db, sir_db=sir_db),
        anti_aliasing_filter=RaisedCosineFilter(
            cutoff_hz=record.filter_cutoff_hz, rolloff=record.filter_rolloff
        ),
    )


def simulate_preset(
    name: str | SimulatedPreset,
    *,
    snr_db: float,
    sir_db: float,
    seed: int | np.random.SeedSequence,
    anti_aliasing_filter: AntiAliasingFilter | None = None,
    interference_model: InterferenceModel = "multiplicative",
    frame_number: int = 0,
    **options: Unpack[PresetOptions],
) -> tuple[Scenario, Observation]:
    """Draw the scene of a preset and simulate its frame, both from one seed.

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
        PARAMETERS["seed"].require(seed, "seed")
        sequence = np.random.SeedSequence(seed)
    require_range("frame_number", frame_number, 0, 1_000_000)
    scene_seed, *noise_seeds = sequence.spawn(2 + frame_number)
    drawn = preset(
        name, snr_db=snr_db, sir_db=sir_db, rng=np.random.default_rng(scene_seed), **options
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
        impairments=impairments_of(options),
        rng=np.random.default_rng(noise_seeds[-1]),
    )
    return scenario, observation


def more_interferers(
    name: str | SimulatedPreset,
    first: Interferer,
    rng: np.random.Generator,
    *,
    num_crossings: int = 1,
) -> tuple[Interferer, ...]:
    """Draw another radar that crosses every interfered ramp beside the bursts of the first.

    It has paths of its own, a slope difference 1.2 to 2 times that of the first, and crosses the
    band 15 to 35 % of a ramp earlier or later.

    Parameters
    ----------
    name : str or SimulatedPreset
        As for `preset`.
    first : Interferer
        The interferer that is there.
    rng : numpy.random.Generator
        Draws all of it.
    num_crossings : int
        1, or 2 for a second chirp of its on the other side of the first interferer's burst; each is
        an interferer of what is returned.
    """
    record, own = simulated_preset(name), first.sequence
    radar = record.radar
    difference = own.slope_hz_per_s - radar.slope_hz_per_s
    slope = radar.slope_hz_per_s + difference * rng.uniform(*_SLOPE_FACTORS)
    ramp_s = radar.num_samples / radar.sample_rate_hz
    side = rng.choice([-1.0, 1.0])
    shifts_s = [side * rng.uniform(*_CROSSING_SHIFTS) * ramp_s]
    channel = record.draw_paths(rng.spawn(3)[1])  # the child that `preset` draws paths with
    if num_crossings == 2:
        shifts_s.append(-side * rng.uniform(*_CROSSING_SHIFTS) * ramp_s)
    return tuple(
        Interferer(
            sequence=interferer_sequence(name, slope_hz_per_s=slope, burst_shift_s=shift_s),
            channel=channel,
        )
        for shift_s in shifts_s
    )


def preset_radar(name: str | SimulatedPreset) -> ChirpSequence:
    """Return the victim radar of a preset; `InputError` for an unknown name."""
    return simulated_preset(name).radar


def interferer_sequence(
    name: str | SimulatedPreset,
    *,
    slope_hz_per_s: float | None = None,
    time_offset_s: float = 0.0,
    burst_shift_s: float = 0.0,
    num_interfered_ramps: int | None = None,
) -> InterfererSequence:
    """Return the interferer of a preset, with another slope or time offset if wanted.

    Parameters
    ----------
    name : str or SimulatedPreset
        One of `vsep.presets.registry.PRESET_NAMES`, or a record of your own.
    slope_hz_per_s : float, optional
        k_I, not that of the victim; the start frequency follows so that the first ramp crosses
        zero intermediate frequency at the same fast time as with the preset's own slope.
    time_offset_s : float
        T-bar, start of the interferer's first ramp.
    burst_shift_s : float
        Added to it, scaled so that the crossing moves inside the victim's ramp by that much.
    num_interfered_ramps : int, optional
        P_I, with a ramp period so near the victim's that every ramp meets one of the victim's; its
        crossing moves by at most 0.6 us from ramp to ramp, as the slopes of Table I are.

    Raises
    ------
    InputError
        If the name is unknown or a number out of its range.
    """
    record = simulated_preset(name)
    own, radar = record.interferer, record.radar
    slope = own.slope_hz_per_s if slope_hz_per_s is None else slope_hz_per_s
    carrier = own.start_frequency_hz - radar.start_frequency_hz
    late = own.slope_hz_per_s * own.time_offset_s
    crossing_s = (late - carrier) / (own.slope_hz_per_s - radar.slope_hz_per_s)
    moved = (own.slope_hz_per_s - slope) * (crossing_s - own.time_offset_s)
    # The course is k_I (T_p p - offset) + (k_I - k) t' + const.
    shift_s = burst_shift_s * (slope - radar.slope_hz_per_s) / slope
    sequence = replace(
        own,
        start_frequency_hz=own.start_frequency_hz + moved,
        slope_hz_per_s=slope,
        time_offset_s=own.time_offset_s + time_offset_s + shift_s,
    )
    if num_interfered_ramps is None:
        return sequence
    require_range("num_interfered_ramps", num_interfered_ramps, 1, radar.num_ramps)
    period_s = radar.ramp_period_s + _PERIOD_DIFFERENCE_S
    return replace(
        sequence, ramp_duration_s=period_s, ramp_period_s=period_s, num_ramps=num_interfered_ramps
    )
