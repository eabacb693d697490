"""Scenes of trials that are no preset: coloured noise, random chirps in a ramp, a recorded frame.

Their randomness is `vsep.studies.study.Trial.seed_sequence` alone.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Final

import numpy as np

from vsep._shipped import shipped_file
from vsep._typing import ComplexArray, frozen
from vsep.calibration.parametric import butterworth
from vsep.files.frame import read_frame
from vsep.inference.core.run import run
from vsep.inference.core.state import SeparationState
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.real_frame import PRESET as REAL_FRAME
from vsep.presets.registry import simulated_preset
from vsep.presets.scenes import Scenario, simulate_preset
from vsep.signal.filters import NoFilter, RaisedCosineFilter
from vsep.signal.measured_filter import MeasuredFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer, Observation, Scene
from vsep.signal.simulate import add_interference, simulate
from vsep.signal.template import SignalModel
from vsep.studies.gap_frames import gap_radar
from vsep.studies.gap_trial import gap_frames
from vsep.studies.scenario import TrialScenario
from vsep.studies.study import GAPS, GapPoint, Trial
from vsep.units import from_db

_COLOURED = "simulation-2-b"
_CORNER, _RISE = 0.02, 9.0  # cycles a sample, and by how much noise rises at beat zero

_ONE_RAMP = replace(simulated_preset("simulation-1").radar, num_samples=256)
_MAX_TARGETS, _LEVEL_SPREAD_DB = 30, 20.0
_MAX_CHIRPS = 4
_DIFFERENCES_HZ_PER_S = (0.3e12, 3e12)  # bursts of a third of the ramp down to a thirtieth

# -3 dB of the receiver's high-pass and low-pass in sample rates.
_HIGH_PASS, _LOW_PASS = 0.005, 0.3
_RESPONSE_SAMPLES = 801
_SHIFT_S = 10e-6


def coloured_noise(trial: Trial) -> TrialScenario:
    """Draw Simulation II b in noise that rises by 10 dB towards beat frequency zero."""
    point, seed = trial.point, trial.seed_sequence
    scenario, white = simulate_preset(
        _COLOURED, snr_db=point.snr_db, sir_db=point.sir_db, seed=seed
    )
    truth = white.truth
    assert truth is not None  # simulated
    noise = _coloured(white.received - truth.object_signal - truth.interference_signal)
    clean = truth.object_signal + noise
    silent = replace(
        truth, interference_signal=frozen(np.zeros_like(truth.object_signal)), bursts=()
    )
    return TrialScenario(
        preset=_COLOURED,
        scenario=scenario,
        model=SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter),
        interfered=Observation(received=frozen(clean + truth.interference_signal), truth=truth),
        clean=Observation(received=frozen(clean), truth=silent),
    )


def _coloured(noise: ComplexArray) -> ComplexArray:
    beats = np.fft.fftfreq(noise.shape[1])
    power = 1.0 + _RISE / (1.0 + (beats / _CORNER) ** 2)
    gain = np.sqrt(power / np.mean(power))
    return np.asarray(np.fft.fft(np.fft.ifft(noise, axis=1) * gain, axis=1))


def random_chirps(trial: Trial) -> TrialScenario:
    """Draw one ramp with up to 30 targets and up to four chirps of random slope and crossing.

    SNR and SIR are those of the point, of total energies; a ramp has 256 samples.
    """
    point = trial.point
    scene_seed, noise_seed = trial.seed_sequence.spawn(2)
    rng = np.random.default_rng(scene_seed)
    count = int(rng.integers(1, _MAX_TARGETS + 1))
    span_s = 0.5 * _ONE_RAMP.sample_rate_hz / _ONE_RAMP.slope_hz_per_s
    levels = from_db(-rng.uniform(0.0, _LEVEL_SPREAD_DB, count))
    objects = Channel(
        delays_s=rng.uniform(0.05, 0.45, count) * 2.0 * span_s,
        dopplers_hz=np.zeros(count),
        weights=np.sqrt(levels) * np.exp(2j * np.pi * rng.uniform(size=count)),
    )
    chirps = tuple(_random_chirp(_ONE_RAMP, rng) for _ in range(rng.integers(1, _MAX_CHIRPS + 1)))
    filtered = RaisedCosineFilter(cutoff_hz=_ONE_RAMP.sample_rate_hz / 4.0, rolloff=0.25)
    scene = Scene(objects=objects, interferers=chirps, snr_db=point.snr_db, sir_db=point.sir_db)
    interfered, clean = (
        simulate(
            _ONE_RAMP,
            replace(scene, interferers=interferers),
            anti_aliasing_filter=filtered,
            rng=np.random.default_rng(noise_seed),
        )
        for interferers in (chirps, ())
    )
    return TrialScenario(
        preset=point.scene,
        scenario=Scenario(radar=_ONE_RAMP, scene=scene, anti_aliasing_filter=filtered),
        model=SignalModel.of_radar(_ONE_RAMP, filtered),
        interfered=interfered,
        clean=clean,
    )


def _random_chirp(radar: ChirpSequence, rng: np.random.Generator) -> Interferer:
    """Another radar, which crosses intermediate frequency zero somewhere in the ramp."""
    low, high = np.log(_DIFFERENCES_HZ_PER_S)
    difference = float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(low, high)))
    ramp_s = radar.num_samples / radar.sample_rate_hz
    crossing_s = float(rng.uniform(0.1, 0.9)) * ramp_s
    weight = np.sqrt(from_db(-rng.uniform(0.0, 6.0))) * np.exp(2j * np.pi * rng.uniform())
    return Interferer(
        sequence=InterfererSequence(
            start_frequency_hz=radar.start_frequency_hz - difference * crossing_s,
            slope_hz_per_s=radar.slope_hz_per_s + difference,
            ramp_duration_s=ramp_s,
            ramp_period_s=ramp_s,
            num_ramps=1,
        ),
        channel=Channel(delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.array([weight])),
    )


def semi_real(trial: Trial) -> TrialScenario:
    """Put bursts into the recorded frame, through a receiver that the estimators do not know.

    Bursts pass a causal Butterworth high-pass and low-pass (`vsep.calibration.parametric`); the
    estimators assume a raised cosine. Misses and false alarms count against the objects that the
    object-only estimator finds in the frame before the bursts come, in as many iterations as all
    methods have there: a person is no set of points. The truth's object signal is that frame, noise
    included. SIR is of total energies; the SNR is the frame's own.
    """
    rng = np.random.default_rng(trial.seed_sequence)
    radar, received = REAL_FRAME.radar, _recorded()
    seed, shift_s = int(rng.integers(2**31)), float(rng.uniform(-_SHIFT_S, _SHIFT_S))
    interferer = REAL_FRAME.draw_interferer(seed, REAL_FRAME.interferer.slope_hz_per_s, shift_s)
    response = parametric_receiver(radar.sample_rate_hz)
    hit = add_interference(
        radar,
        received,
        [interferer],
        sir_db=trial.point.sir_db,
        anti_aliasing_filter=response,
        interference_model="convolution",
    ).truth
    assert hit is not None  # simulated
    state = _found()
    truth = replace(
        hit,
        beats=state.objects.beats,
        dopplers=state.objects.dopplers,
        amplitudes=state.objects.amplitudes,
        noise_precision=state.noise_precision,
    )
    silent = replace(truth, interference_signal=frozen(np.zeros_like(received)), bursts=())
    objects = Channel(
        delays_s=radar.delay_from_beat(truth.beats),
        dopplers_hz=truth.dopplers / radar.ramp_period_s,
        weights=truth.amplitudes,
    )
    scene = Scene(
        objects=objects,
        interferers=(interferer,),
        snr_db=trial.point.snr_db,
        sir_db=trial.point.sir_db,
    )
    return TrialScenario(
        preset=REAL_FRAME.name,
        scenario=Scenario(radar=radar, scene=scene, anti_aliasing_filter=response),
        model=_assumed_model(),
        interfered=Observation(received=frozen(received + hit.interference_signal), truth=truth),
        clean=Observation(received=received, truth=silent),
        max_iterations=REAL_FRAME.max_iterations,
    )


def parametric_receiver(sample_rate_hz: float) -> MeasuredFilter:
    """Receiver response of the semi-real scenes: causal Butterworth high-pass and low-pass."""
    frequency_hz = np.linspace(-0.75, 0.75, _RESPONSE_SAMPLES) * sample_rate_hz
    return MeasuredFilter(
        frequency_hz=frequency_hz,
        response=butterworth(frequency_hz, _HIGH_PASS * sample_rate_hz, _LOW_PASS * sample_rate_hz),
    )


def _assumed_model() -> SignalModel:
    assumed = RaisedCosineFilter(
        cutoff_hz=REAL_FRAME.filter_cutoff_hz, rolloff=REAL_FRAME.filter_rolloff
    )
    return SignalModel.of_radar(REAL_FRAME.radar, assumed)


@cache
def _recorded() -> ComplexArray:
    """(P, N) the shipped frame in the paper's sign."""
    return frozen(np.array(read_frame(shipped_file(REAL_FRAME.frame_file)).received))


@cache
def _found() -> SeparationState:
    """Objects of the shipped frame, as the object-only estimator finds them."""
    estimator = ObjectOnlySeparator(
        model=_assumed_model(), max_iterations=REAL_FRAME.max_iterations
    )
    return run(estimator, _recorded()).state


def sequence_with_gaps(trial: Trial) -> TrialScenario:
    """Return the last frame of a sequence with gaps; its chirps are no bursts of a model."""
    frame = gap_frames(trial)[0][-1]
    point = trial.point
    assert isinstance(point, GapPoint)
    radar = gap_radar(point.num_ramps, point.num_samples)
    hit = replace(frame.truth, interference_signal=frozen(frame.received - frame.intact))
    objects = Channel(
        delays_s=radar.delay_from_beat(hit.beats),
        dopplers_hz=hit.dopplers / radar.ramp_period_s,
        weights=hit.amplitudes,
    )
    return TrialScenario(
        preset=point.scene,
        scenario=Scenario(
            radar=radar,
            scene=Scene(objects=objects, snr_db=point.snr_db, sir_db=point.sir_db),
            anti_aliasing_filter=NoFilter(),
        ),
        model=SignalModel.of_radar(radar, NoFilter()),
        interfered=Observation(received=frozen(frame.received), truth=hit),
        clean=Observation(received=frame.intact, truth=frame.truth),
    )


DRAWN_SCENES: Final[dict[str, Callable[[Trial], TrialScenario]]] = {
    "coloured-noise": coloured_noise,
    "random-chirps": random_chirps,
    "semi-real": semi_real,
    GAPS: sequence_with_gaps,
}
"""All of them by name, those of `vsep.studies.study.DRAWN`."""
