"""Scenes of the presets as several antennas receive them."""

from dataclasses import replace
from typing import Unpack, cast

import numpy as np

from vsep._typing import FloatArray
from vsep.parameters import PARAMETERS
from vsep.presets.record import SimulatedPreset
from vsep.presets.registry import simulated_preset
from vsep.presets.scenes import MAX_DEG, PresetOptions, Scenario, preset
from vsep.signal.doppler_division import ONE, divided_scene, known_division
from vsep.signal.filters import AntiAliasingFilter
from vsep.signal.impairments import impairments_of
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.scene import Observation
from vsep.signal.simulate import InterferenceModel, simulate_antennas


class ReceptionOptions(PresetOptions, total=False):
    """Optional keywords of `simulate_preset` that every antenna has in common."""

    anti_aliasing_filter: AntiAliasingFilter | None
    interference_model: InterferenceModel


def simulate_preset_antennas(
    name: str | SimulatedPreset,
    antennas: UniformLinearArray,
    *,
    snr_db: float,
    sir_db: float,
    seed: int,
    object_angles_deg: FloatArray | None = None,
    interferer_angles_deg: FloatArray | None = None,
    **options: Unpack[ReceptionOptions],
) -> tuple[Scenario, Observation]:
    """Draw the scene of a preset with directions and simulate what all antennas receive.

    The first antenna receives the objects and bursts of `simulate_preset` with the same seed; the
    noise is another one. Directions come from a child of the seed of their own: giving some of them
    leaves all others as they are.

    Parameters
    ----------
    name : str or SimulatedPreset
        As for `preset`.
    antennas : UniformLinearArray
        Who receives it.
    snr_db, sir_db : float
        (25) and (26) of one antenna.
    seed : int
        Not negative.
    object_angles_deg : (L,) float, optional
        Directions of the objects; drawn by default.
    interferer_angles_deg : (I,) float, optional
        Directions of the interferers; drawn by default.
    **options : ReceptionOptions
        As for `simulate_preset`; with a `doppler_division` see `divided_scene`.

    Returns
    -------
    Scenario
        With the filter that was used.
    Observation
        Signals are (A, P, N).

    Raises
    ------
    InputError
        If the name is unknown, a number out of its range, or the directions are not as many as
        there are objects or interferers.

    Examples
    --------
    >>> line = UniformLinearArray(num_antennas=4)
    >>> _, seen = simulate_preset_antennas("simulation-1", line, snr_db=30, sir_db=-20, seed=1,
    ...                                    object_angles_deg=[20.0])
    >>> seen.received.shape, seen.truth.angles_deg.tolist()
    ((4, 1, 256), [20.0])
    """
    PARAMETERS["seed"].require(seed, "seed")
    # The first two children are those of `simulate_preset`.
    scene_seed, noise_seed, object_seed, interferer_seed = np.random.SeedSequence(seed).spawn(4)
    rng = np.random.default_rng(scene_seed)
    used = options.pop("anti_aliasing_filter", None)
    model = options.pop("interference_model", "multiplicative")
    usual = simulated_preset(name).doppler_division
    division = known_division(options.pop("doppler_division", usual))
    options["doppler_division"] = ONE
    drawn = preset(name, snr_db=snr_db, sir_db=sir_db, rng=rng, **cast(PresetOptions, options))
    if used is not None:
        drawn = replace(drawn, anti_aliasing_filter=used)
    widest = min(MAX_DEG, antennas.unambiguous_angle_deg)
    given = object_angles_deg, interferer_angles_deg
    counts = drawn.scene.objects.num_paths, len(drawn.scene.interferers)
    angles = [
        np.random.default_rng(own_seed).uniform(-widest, widest, count) if own is None else own
        for own, own_seed, count in zip(given, (object_seed, interferer_seed), counts, strict=True)
    ]
    antenna_scene = AntennaScene(
        scene=drawn.scene,
        antennas=antennas,
        object_angles_deg=angles[0],
        interferer_angles_deg=angles[1],
    )
    if division is not None:
        antenna_scene = divided_scene(antenna_scene, drawn.radar, division)
    observation = simulate_antennas(
        drawn.radar,
        antenna_scene,
        anti_aliasing_filter=drawn.anti_aliasing_filter,
        interference_model=model,
        impairments=impairments_of(options),
        rng=np.random.default_rng(noise_seed),
    )
    return drawn, observation
