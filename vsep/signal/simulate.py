"""Simulated frames: objects (5), interference (7) or (40), noise; levels by (25) and (26)."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from vsep._typing import ComplexArray, FloatArray, frozen
from vsep._validation import require_choice, require_range
from vsep.errors import InputError
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.bursts import convolved_bursts, multiplicative_bursts, true_bursts
from vsep.signal.chirped_atoms import chirped_factors
from vsep.signal.dithered_atoms import coupled_signals
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.impairments import ReceiverImpairments, TrueReceiver, impaired
from vsep.signal.linear_array import AntennaScene
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel, GroundTruth, Interferer, Observation, Scene, TrueBurst
from vsep.signal.transmitters import NO_CHIRPS, chirp_parts, noise_like_signal
from vsep.units import from_db, wrap_frequency

InterferenceModel: TypeAlias = Literal["multiplicative", "convolution", "convolution-with-edges"]
INTERFERENCE_MODELS: tuple[InterferenceModel, ...] = get_args(InterferenceModel)


def simulate(
    radar: ChirpSequence,
    scene: Scene,
    *,
    anti_aliasing_filter: AntiAliasingFilter,
    interference_model: InterferenceModel = "multiplicative",
    impairments: ReceiverImpairments | None = None,
    rng: np.random.Generator,
) -> Observation:
    """Simulate one frame, (1).

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    scene : Scene
        Objects, interferers, SNR (25) and SIR (26). The weights of the objects are those of
        unit-norm atoms (10); the constant phase of a delay at the start frequency counts as part
        of them. Without objects an energy of one stands in for theirs in both ratios. Where the
        radar has `range_migration`, objects move on at their velocities and delays are those at
        mid-frame.
    anti_aliasing_filter : AntiAliasingFilter
        The filter that shapes the bursts. Objects are not filtered, wherever they lie: a quarter
        of Simulation II's have beat frequencies where its filter already falls off.
    interference_model : str
        One of `INTERFERENCE_MODELS`.
    impairments : ReceiverImpairments, optional
        What is wrong with oscillator and receiver; the truth's signals are without it.
    rng : numpy.random.Generator
        Draws the noise and, after it, what the impairments need.

    Returns
    -------
    Observation
        The received frame with its truth. Without a burst inside the band there is no
        interference, whatever the SIR.

    Raises
    ------
    InputError
        If the interference model is unknown or does not suit the interferer.
    """
    channel = scene.objects
    beats = wrap_frequency(radar.beat_from_delay(channel.delays_s))
    dopplers = radar.doppler_from_hz(channel.dopplers_hz)
    if radar.migration.coupling == 0.0:
        dopplers = wrap_frequency(dopplers)
    curvatures = _curvatures(radar, channel)
    object_signal = _object_signals(radar, beats, dopplers, channel.weights[:, None], curvatures)[0]
    energy = _energy(object_signal) if channel.num_paths else 1.0
    if energy == 0.0:
        raise InputError("The objects have no energy; at least one weight must not be zero.")
    interference = _interference(radar, scene.interferers, anti_aliasing_filter, interference_model)
    interference = _with_energy(interference, energy / float(from_db(scene.sir_db)))
    noise_precision = float(from_db(scene.snr_db)) / energy
    draws = rng.standard_normal((2, *radar.shape))
    noise = (draws[0] + 1j * draws[1]) * np.sqrt(0.5 / noise_precision)
    received, receiver = _received(
        object_signal + interference + noise, impairments, noise_precision, radar, rng
    )
    truth = GroundTruth(
        beats=frozen(beats),
        dopplers=frozen(dopplers),
        amplitudes=channel.weights,
        object_signal=frozen(object_signal),
        interference_signal=frozen(interference),
        bursts=_true_bursts(radar, scene.interferers, anti_aliasing_filter),
        noise_precision=noise_precision,
        receiver=receiver,
        waveforms=tuple(interferer.waveform for interferer in scene.interferers),
        groups=channel.groups,
        curvatures=curvatures,
    )
    return Observation(received=frozen(received), truth=truth)


def simulate_antennas(
    radar: ChirpSequence,
    antenna_scene: AntennaScene,
    *,
    anti_aliasing_filter: AntiAliasingFilter,
    interference_model: InterferenceModel = "multiplicative",
    impairments: ReceiverImpairments | None = None,
    rng: np.random.Generator,
) -> Observation:
    """Simulate what several antennas receive; one antenna receives what `simulate` makes.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    antenna_scene : AntennaScene
        What is there and where, and the antennas.
    anti_aliasing_filter, interference_model, impairments, rng
        As for `simulate`; the antennas have the same filter and oscillator and independent noise.

    Returns
    -------
    Observation
        Signals are (A, P, N), the truth's amplitudes (L, A); it has the directions.
    """
    scene, antennas = antenna_scene.scene, antenna_scene.antennas
    first = simulate(
        radar,
        scene,
        anti_aliasing_filter=anti_aliasing_filter,
        interference_model=interference_model,
        rng=rng,
    ).truth
    assert first is not None  # `simulate` knows it
    shape = antennas.num_antennas, *radar.shape
    amplitudes = first.amplitudes[:, None] * antennas.steering(antenna_scene.object_angles_deg)
    points = first.beats, first.dopplers
    object_signal = _object_signals(radar, *points, amplitudes, first.curvatures)
    interference = np.zeros(shape, dtype=np.complex128)
    steering = antennas.steering(antenna_scene.interferer_angles_deg)
    for interferer, weights in zip(scene.interferers, steering, strict=True):
        bursts = _interference(radar, (interferer,), anti_aliasing_filter, interference_model)
        interference += weights[:, None, None] * bursts
    energy = antennas.num_antennas * (_energy(object_signal[0]) if scene.objects.num_paths else 1.0)
    interference = _with_energy(interference, energy / float(from_db(scene.sir_db)))
    draws = rng.standard_normal((2, *shape))
    noise = (draws[0] + 1j * draws[1]) * np.sqrt(0.5 / first.noise_precision)
    received, receiver = _received(
        object_signal + interference + noise, impairments, first.noise_precision, radar, rng
    )
    truth = replace(
        first,
        amplitudes=frozen(amplitudes),
        object_signal=frozen(object_signal),
        interference_signal=frozen(interference),
        angles_deg=antenna_scene.object_angles_deg,
        interferer_angles_deg=antenna_scene.interferer_angles_deg,
        receiver=receiver,
    )
    return Observation(received=frozen(received), truth=truth)


def add_interference(
    radar: ChirpSequence,
    received: ComplexArray,
    interferers: Sequence[Interferer],
    *,
    sir_db: float,
    anti_aliasing_filter: AntiAliasingFilter,
    interference_model: InterferenceModel = "multiplicative",
) -> Observation:
    """Add simulated bursts to a frame that has none.

    Parameters
    ----------
    radar : ChirpSequence
        The radar that received the frame.
    received : (P, N) complex
        The frame in the paper's sign.
    interferers : sequence of Interferer
        Whose bursts to add.
    sir_db : float
        Energy of the whole frame, its noise included, over that of the interference.
    anti_aliasing_filter, interference_model
        As for `simulate`.

    Returns
    -------
    Observation
        The truth holds the frame itself as the object signal, no objects and no noise precision.

    Raises
    ------
    InputError
        If the frame does not fit the radar, is not finite or is zero everywhere.
    """
    frame = np.array(received, dtype=np.complex128)
    if frame.shape != radar.shape:
        raise InputError(f"received has shape {frame.shape}; it must be {radar.shape}.")
    if not np.all(np.isfinite(frame)):
        raise InputError("received holds NaN or infinity; all its samples must be finite.")
    if not np.any(frame):
        raise InputError("received is zero everywhere; at least one sample must not be.")
    require_range("SIR", sir_db, -200.0, 200.0, "dB")
    interference = _interference(radar, interferers, anti_aliasing_filter, interference_model)
    interference = _with_energy(interference, _energy(frame) / float(from_db(sir_db)))
    truth = GroundTruth(
        beats=frozen(np.zeros(0)),
        dopplers=frozen(np.zeros(0)),
        amplitudes=frozen(np.zeros(0, dtype=np.complex128)),
        object_signal=frozen(frame),
        interference_signal=frozen(interference),
        bursts=_true_bursts(radar, interferers, anti_aliasing_filter),
        noise_precision=float("nan"),
    )
    return Observation(received=frozen(frame + interference), truth=truth)


def _received(
    signal: ComplexArray,
    impairments: ReceiverImpairments | None,
    noise_precision: float,
    radar: ChirpSequence,
    rng: np.random.Generator,
) -> tuple[ComplexArray, TrueReceiver | None]:
    """Return what the receiver delivers of a signal, and what it did to it."""
    if impairments is None:
        return signal, None
    return impaired(
        signal,
        impairments,
        noise_power=1.0 / noise_precision,
        sample_rate_hz=radar.sample_rate_hz,
        rng=rng,
    )


def _curvatures(radar: ChirpSequence, channel: Channel) -> FloatArray | None:
    """Half of the changes of the Doppler frequencies from ramp to ramp, None without any."""
    rates = channel.doppler_rates_hz_per_s
    if rates is None:
        return None
    if radar.migration.coupling != 0.0:
        raise InputError(
            "Objects accelerate, and range_migration is on or ramps are dithered; accelerating "
            "objects are simulated in their range cells and with equal ramps only."
        )
    return frozen(0.5 * rates * radar.ramp_period_s**2)


def _object_signals(
    radar: ChirpSequence,
    beats: FloatArray,
    dopplers: FloatArray,
    weights: ComplexArray,
    curvatures: FloatArray | None = None,
) -> ComplexArray:
    """Objects with weights (L, A) as the antennas receive them, (A, P, N)."""
    migration = radar.migration
    if migration.coupling != 0.0:
        points = np.stack([beats, dopplers], axis=1)
        signals = coupled_signals(points, weights, migration, *radar.shape)
        return signals.reshape(-1, *radar.shape)
    along = line_factors(dopplers, radar.num_ramps)
    if curvatures is not None:
        along = chirped_factors(dopplers, curvatures, radar.num_ramps)
    factors = line_factors(beats, radar.num_samples), along
    return np.array([synthesize(each, *factors) for each in weights.T])


def _interference(
    radar: ChirpSequence,
    interferers: Sequence[Interferer],
    anti_aliasing_filter: AntiAliasingFilter,
    model: InterferenceModel,
) -> ComplexArray:
    """Sum over the interferers with the relative levels that their channel weights set."""
    require_choice("The interference model", model, INTERFERENCE_MODELS)
    total = np.zeros(radar.shape, dtype=np.complex128)
    for interferer in interferers:
        if interferer.waveform in NO_CHIRPS:
            total += noise_like_signal(radar, interferer, anti_aliasing_filter)
    for part in _all_chirps(radar, interferers, anti_aliasing_filter):
        if model == "multiplicative":
            total += multiplicative_bursts(radar, part, anti_aliasing_filter)
        else:
            total += convolved_bursts(
                radar,
                part,
                anti_aliasing_filter,
                with_edges=model == "convolution-with-edges",
            )
    return total


def _all_chirps(
    radar: ChirpSequence,
    interferers: Sequence[Interferer],
    anti_aliasing_filter: AntiAliasingFilter,
) -> list[Interferer]:
    """Interferers as such of equal chirps."""
    return [
        part
        for interferer in interferers
        for part in chirp_parts(radar, interferer, anti_aliasing_filter)
    ]


def _true_bursts(
    radar: ChirpSequence,
    interferers: Sequence[Interferer],
    anti_aliasing_filter: AntiAliasingFilter,
) -> tuple[TrueBurst, ...]:
    """Bursts of all interferers in the order of the ramps."""
    bursts = [
        burst
        for part in _all_chirps(radar, interferers, anti_aliasing_filter)
        for burst in true_bursts(radar, part.sequence, anti_aliasing_filter)
    ]
    return tuple(sorted(bursts, key=lambda burst: burst.ramp))


def _with_energy(signal: ComplexArray, energy: float) -> ComplexArray:
    """Scale a signal to an energy; without any energy it stays zero."""
    present = _energy(signal)
    return signal * np.sqrt(energy / present) if present > 0.0 else signal


def _energy(signal: ComplexArray) -> float:
    return float(np.sum(np.abs(signal) ** 2))
