"""``vsep simulate``: a frame file from a preset, or a folder of those of a sequence."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from vsep._typing import FloatArray
from vsep.errors import InputError
from vsep.files.frame import Frame, write_frame
from vsep.parameters import FILTER_PARAMETERS, PARAMETERS, SCENE_PARAMETERS
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.registry import PRESET_NAMES, simulated_preset
from vsep.presets.scenes import Scenario, simulate_preset
from vsep.presets.settings import chosen_filter, simulator_options
from vsep.presets.street import MOST_FRAMES, street_frame
from vsep.presets.street_settings import STREET, STREET_OPTIONS, STREET_SETTINGS, street_options
from vsep.signal.doppler_division import ONE
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.motion import CYCLE_S
from vsep.signal.scene import Observation
from vsep.tracking.sources import frame_of_street
from vsep_app.cli.progress import counted
from vsep_app.cli.scene_options import ASSUMED, SCENE_OPTIONS, add_scene_options, scene_values
from vsep_app.cli.shared_options import (
    add_number,
    add_out,
    defaults_of,
    given,
    integer,
    refuse_unused,
    refuse_without_interference,
    require_folder,
)

DESCRIPTION = "Make a frame file from a preset, or those of a sequence."
EXAMPLES = """\
examples:
  vsep simulate --preset simulation-2-a --snr-db 60 --sir-db -20 --seed 7 --out frame.npz
  vsep simulate --preset simulation-2-b --interferer-slope 9.6 --second-interferer --num-objects 20
      --filter-kind butterworth --filter-order 4 --assumed-kind raised_cosine --out hard.npz
  vsep simulate --preset simulation-2-b --antennas 4 --interferer-angle-deg -25 --out array.npz
  vsep simulate --preset street --frames 200 --out street
"""
_MAX_ANTENNAS = 1024
_ARRAY_OPTIONS = (
    "antenna_spacing_wavelengths",
    "object_angles_deg",
    "interferer_angle_deg",
)
_FILTER = tuple(each.name for each in FILTER_PARAMETERS if each.name.startswith("filter_"))
_SETTINGS = {"an array": frozenset(_ARRAY_OPTIONS), "one antenna": frozenset[str]()}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--preset",
        choices=(*PRESET_NAMES, STREET),
        required=True,
        help=f"scene and radar from the paper, or {STREET}: a drive past cars with radars",
    )
    add_out(parser, "the frame file, *.npz; with --frames the folder for them, made if need be")
    add_number(
        parser,
        "--frames",
        f"a sequence of so many frames, {1e3 * CYCLE_S:g} ms apart (default: one frame)",
        kind=integer(1, MOST_FRAMES),
    )
    add_scene_options(parser, "the preset, whose own values are the defaults; seed: 0")
    group = parser.add_argument_group(
        "several antennas", "A uniform line of them; SNR and SIR are those of one antenna."
    )
    add_number(
        group,
        "--antennas",
        "how many receive (default: 1)",
        kind=integer(1, _MAX_ANTENNAS),
        default=1,
    )
    add_number(
        group,
        "--antenna-spacing-wavelengths",
        f"from one to the next (default: {defaults_of(UniformLinearArray)['spacing_wavelengths']})",
    )
    add_number(
        group,
        "--object-angles-deg",
        "direction of every object from broadside, positive towards the last antenna "
        "(default: drawn from the seed, up to 60 to both sides)",
        nargs="+",
    )
    add_number(
        group,
        "--interferer-angle-deg",
        "direction of every interferer (default: drawn likewise)",
        nargs="+",
    )


def run(options: argparse.Namespace) -> int:
    """Simulate a preset and write its frame file, or those of a sequence."""
    require_folder(options.out)
    make = _street_maker(options) if options.preset == STREET else _preset_maker(options)
    if options.frames is None:
        write_frame(options.out, make(0, options.out))
        return 0
    folder = Path(options.out)
    folder.mkdir(exist_ok=True)
    for number in counted(range(options.frames), options.frames, "frame"):
        path = str(folder / f"{number:06d}.npz")
        write_frame(path, make(number, path))
    return 0


def _street_maker(options: argparse.Namespace) -> Callable[[int, str], Frame]:
    """Return what makes a frame of the street of a number and a name."""
    usual = {each.name: each.default for each in (*SCENE_PARAMETERS, *FILTER_PARAMETERS)}
    usual |= STREET_SETTINGS
    values = scene_values(options, usual)
    settings = {STREET: frozenset(STREET_OPTIONS), "any other preset": frozenset(SCENE_OPTIONS)}
    settings["any other preset"] |= {"antennas", *_ARRAY_OPTIONS}
    several = {"antennas": options.antennas} if options.antennas > 1 else {}
    refuse_unused(given(options, (*SCENE_OPTIONS, *_ARRAY_OPTIONS)) | several, (STREET,), settings)
    keywords = street_options(usual | values)

    def make(number: int, path: str) -> Frame:
        return replace(frame_of_street(street_frame(number, **keywords)), name=path)

    return make


def _preset_maker(options: argparse.Namespace) -> Callable[[int, str], Frame]:
    """Return what makes a frame of a preset of a number and a name."""
    several = options.antennas > 1
    chosen = "an array" if several else "one antenna"
    refuse_unused(given(options, _ARRAY_OPTIONS), (chosen,), _SETTINGS)
    if options.no_interference:
        refuse_without_interference(given(options, ("interferer_angle_deg",)))
    preset = simulated_preset(options.preset)
    usual = {each.name: each.default for each in (*SCENE_PARAMETERS, *FILTER_PARAMETERS)}
    usual |= preset.defaults()
    values = scene_values(options, usual)
    levels = {"snr_db": preset.snr_db, "sir_db": preset.sir_db, "seed": 0} | values
    settings = {"preset": options.preset} | {
        f"true_{name}" if name in _FILTER else name: str(int(value) if value is True else value)
        for name, value in levels.items()
        if not (options.no_interference and PARAMETERS[name].of_bursts)
    }
    division = (usual | values)["doppler_division"]
    if division != ONE:
        settings["doppler_division"] = division
    array = _array(options)
    keywords = simulator_options(levels)
    if given(options, _FILTER):
        keywords["anti_aliasing_filter"] = chosen_filter(usual | values, "filter")
    if several and options.frames is not None:
        raise InputError(
            f"--frames is {options.frames} and --antennas {options.antennas}; a sequence has 1."
        )

    def make(number: int, path: str) -> Frame:
        moved = {} if several else {"frame_number": number}
        scenario, observation = _simulated(options, array, keywords | moved)
        assumed = scenario.anti_aliasing_filter
        if given(options, ASSUMED):
            assumed = chosen_filter(usual | values, "assumed")
        truth = observation.truth
        assert truth is not None  # the simulator knows it
        return Frame(
            received=observation.received[0] if several else observation.received,
            radar=scenario.radar,
            anti_aliasing_filter=assumed,
            truth=truth.of_antenna(0) if several else truth,
            name=path,
            settings=settings,
            antennas=observation.received if several else None,
            antenna_spacing_wavelengths=array.spacing_wavelengths if several else None,
            antennas_truth=truth if several else None,
        )

    return make


def _array(options: argparse.Namespace) -> UniformLinearArray:
    if options.antenna_spacing_wavelengths is None:
        return UniformLinearArray(num_antennas=options.antennas)
    return UniformLinearArray(
        num_antennas=options.antennas, spacing_wavelengths=options.antenna_spacing_wavelengths
    )


def _simulated(
    options: argparse.Namespace, array: UniformLinearArray, keywords: dict[str, Any]
) -> tuple[Scenario, Observation]:
    if array.num_antennas == 1:
        return simulate_preset(options.preset, **keywords)
    return simulate_preset_antennas(
        options.preset,
        array,
        object_angles_deg=_as_array(options.object_angles_deg),
        interferer_angles_deg=_as_array(options.interferer_angle_deg),
        **keywords,
    )


def _as_array(angles: list[float] | None) -> FloatArray | None:
    return None if angles is None else np.array(angles)
