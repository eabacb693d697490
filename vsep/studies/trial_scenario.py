"""The scene of a trial: one frame with interference, the same frame without, and the bounds.

Chosen here where the paper is open: the parameter sets of Simulation II are taken in turn, which
is as random as drawing them and balances the points.
"""

from dataclasses import replace

import numpy as np

from vsep._typing import frozen
from vsep.presets.registry import NOISE_SCENES, SCENES, simulated_preset
from vsep.presets.scenes import (
    PresetOptions,
    Scenario,
    more_interferers,
    simulate_preset,
)
from vsep.signal.filters import AntiAliasingFilter, ButterworthFilter, RaisedCosineFilter
from vsep.signal.scene import Channel, Observation, Scene
from vsep.signal.simulate import simulate
from vsep.signal.template import SignalModel
from vsep.studies.drawn_scenes import DRAWN_SCENES
from vsep.studies.scenario import TrialScenario
from vsep.studies.study import Point, Trial


def simulate_trial(trial: Trial) -> TrialScenario:
    """Draw the scene of a trial and simulate its two frames.

    Parameters
    ----------
    trial : Trial
        Its randomness is `Trial.seed_sequence` alone: the first child draws the scene, the second
        the noise, as `vsep.simulate_preset` does, the third a second interferer.

    Raises
    ------
    InputError
        If a number of the point is out of range.
    """
    point = trial.point
    if point.scene in NOISE_SCENES:
        return _noise_scenario(trial)
    if point.scene in DRAWN_SCENES:
        return DRAWN_SCENES[point.scene](trial)
    name = preset_name(point, trial.realization)
    filtered = _true_filter(name, point)
    options: PresetOptions = {
        "interferer_slope_hz_per_s": point.interferer_slope_hz_per_s,
        "num_interfered_ramps": point.num_interfered_ramps,
        "num_objects": point.num_objects,
        "object_delay_s": point.object_delay_s,
    }
    no_bursts: PresetOptions = {**options, "interference": False}
    scenario, interfered = simulate_preset(
        name,
        snr_db=point.snr_db,
        sir_db=point.sir_db,
        seed=trial.seed_sequence,
        anti_aliasing_filter=filtered,
        interference_model=point.interference_model,
        **options,
    )
    _, clean = simulate_preset(
        name, snr_db=point.snr_db, sir_db=point.sir_db, seed=trial.seed_sequence, **no_bursts
    )
    if point.num_interferers == 2:
        scenario, interfered = _with_second_interferer(name, scenario, trial)
    if point.cut_bursts or point.rolled_ramps:
        scenario, interfered = _with_other_bursts(scenario, interfered, point)
    return TrialScenario(
        preset=name,
        scenario=scenario,
        model=_assumed_model(name, point),
        interfered=interfered,
        clean=clean,
    )


def preset_name(point: Point, realization: int) -> str:
    """Name the scene of Table I that a realisation shows.

    Examples
    --------
    >>> point = Point(panel="5d-f", scene="simulation-2", snr_db=60.0, sir_db=0.0)
    >>> preset_name(point, 4)
    'simulation-2-b'
    """
    turns = SCENES[point.scene]
    return turns[realization % len(turns)].name


def _true_filter(name: str, point: Point) -> AntiAliasingFilter:
    """Return the raised cosine, or a Butterworth filter with its half-amplitude frequency."""
    if point.butterworth_order == 0:
        return _raised_cosine(name, point)
    cutoff_hz = _raised_cosine(name, point).cutoff_hz
    return ButterworthFilter(cutoff_hz=cutoff_hz, order=point.butterworth_order)


def _raised_cosine(name: str, point: Point, mismatch: float = 0.0) -> RaisedCosineFilter:
    """Filter of the preset with the cut-off of the point, larger by a share of it."""
    preset = simulated_preset(name)
    cutoff_hz = (
        preset.filter_cutoff_hz if point.filter_cutoff_hz is None else point.filter_cutoff_hz
    )
    return RaisedCosineFilter(cutoff_hz=cutoff_hz * (1.0 + mismatch), rolloff=preset.filter_rolloff)


def _assumed_model(name: str, point: Point) -> SignalModel:
    assumed = _raised_cosine(name, point, point.filter_mismatch)
    return SignalModel.of_radar(simulated_preset(name).radar, assumed)


def _noise_scenario(trial: Trial) -> TrialScenario:
    """Noise alone, of the size of a preset's frame."""
    name = preset_name(trial.point, 0)
    none = np.zeros(0)
    nothing = Channel(delays_s=none, dopplers_hz=none, weights=none.astype(np.complex128))
    scenario = Scenario(
        radar=simulated_preset(name).radar,
        scene=Scene(objects=nothing, snr_db=trial.point.snr_db, sir_db=trial.point.sir_db),
        anti_aliasing_filter=_raised_cosine(name, trial.point),
    )
    observation = simulate(
        scenario.radar,
        scenario.scene,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        rng=np.random.default_rng(trial.seed_sequence.spawn(2)[1]),
    )
    return TrialScenario(
        preset=trial.point.scene,
        scenario=scenario,
        model=_assumed_model(name, trial.point),
        interfered=observation,
        clean=observation,
    )


def _with_second_interferer(
    name: str, scenario: Scenario, trial: Trial
) -> tuple[Scenario, Observation]:
    """Put one or two more bursts into every interfered ramp; objects, first burst, noise stay."""
    _, noise_seed, other_seed = trial.seed_sequence.spawn(3)
    first = scenario.scene.interferers[0]
    more = more_interferers(
        name,
        first,
        np.random.default_rng(other_seed),
        num_crossings=trial.point.num_second_crossings,
    )
    moved = replace(scenario, scene=replace(scenario.scene, interferers=(first, *more)))
    observation = simulate(
        moved.radar,
        moved.scene,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        interference_model=trial.point.interference_model,
        rng=np.random.default_rng(noise_seed),
    )
    return moved, observation


def _with_other_bursts(
    scenario: Scenario, observation: Observation, point: Point
) -> tuple[Scenario, Observation]:
    """Cut bursts to the pass band of the filter, or move them by ramps; the model has none then."""
    truth, radar = observation.truth, scenario.radar
    assert truth is not None  # simulated
    interference = truth.interference_signal
    if point.cut_bursts:
        inside = np.zeros(radar.shape, dtype=np.bool_)
        filtered = scenario.anti_aliasing_filter
        outer_hz = getattr(filtered, "outer_hz", filtered.cutoff_hz)
        for burst in truth.bursts:
            course_hz = burst.start_frequency_hz + burst.slope_hz_per_s * radar.sample_times_s
            inside[burst.ramp] |= np.abs(course_hz) < outer_hz
        interference = np.where(inside, interference, 0.0)
    moved = frozen(np.roll(interference, point.rolled_ramps, axis=0))
    received = observation.received - truth.interference_signal + moved
    changed = replace(truth, interference_signal=moved, bursts=())
    silent = replace(scenario, scene=replace(scenario.scene, interferers=()))
    return silent, Observation(received=frozen(received), truth=changed)
