"""``vsep simulate``: a frame file from a preset."""

import argparse

import numpy as np

from vsep._typing import FloatArray
from vsep.files.frame import Frame, write_frame
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.registry import PRESET_NAMES, simulated_preset
from vsep.presets.scenes import Scenario, simulate_preset
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.scene import Observation
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

DESCRIPTION = "Make a frame file from a preset."
EXAMPLES = """\
examples:
  vsep simulate --preset simulation-2-a --snr-db 60 --sir-db -20 --seed 7 --out frame.npz
  vsep simulate --preset simulation-2-b --antennas 4 --interferer-angle-deg -25 --out array.npz
"""
# Seeds are kept as 64-bit integers in frame files.
_MAX_SEED = 2**63 - 1
_MAX_ANTENNAS = 1024
_ARRAY_OPTIONS = ("antenna_spacing_wavelengths", "object_angles_deg", "interferer_angle_deg")
_INTERFERER_OPTIONS = ("sir_db", "interferer_angle_deg")
_SETTINGS = {"an array": frozenset(_ARRAY_OPTIONS), "one antenna": frozenset[str]()}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument(
        "--preset", choices=PRESET_NAMES, required=True, help="scene and radar from the paper"
    )
    add_number(
        parser,
        "--snr-db",
        "object energy of the frame over the noise power of a sample (default: the preset's)",
    )
    add_number(
        parser,
        "--sir-db",
        "object energy over interference energy of the frame (default: the preset's)",
    )
    add_number(
        parser,
        "--seed",
        "the same seed gives the same file, byte for byte (default: 0)",
        kind=integer(0, _MAX_SEED),
        default=0,
    )
    parser.add_argument(
        "--no-interference",
        action="store_true",
        help="leave the interferer out; objects and noise stay the same",
    )
    add_out(parser, "the frame file, *.npz")
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
        group, "--interferer-angle-deg", "direction of the interferer (default: drawn likewise)"
    )


def run(options: argparse.Namespace) -> int:
    """Simulate a preset and write its frame file."""
    require_folder(options.out)
    several = options.antennas > 1
    chosen = "an array" if several else "one antenna"
    refuse_unused(given(options, _ARRAY_OPTIONS), (chosen,), _SETTINGS)
    if options.no_interference:
        refuse_without_interference(given(options, _INTERFERER_OPTIONS))
    preset = simulated_preset(options.preset)
    options.snr_db = preset.snr_db if options.snr_db is None else options.snr_db
    options.sir_db = preset.sir_db if options.sir_db is None else options.sir_db
    settings = {
        "preset": options.preset,
        "snr_db": repr(options.snr_db),
        "seed": str(options.seed),
    }
    if not options.no_interference:
        settings["sir_db"] = repr(options.sir_db)
    array = _array(options)
    scenario, observation = _simulated(options, array)
    truth = observation.truth
    assert truth is not None  # the simulator knows it
    frame = Frame(
        received=observation.received[0] if several else observation.received,
        radar=scenario.radar,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        truth=truth.of_antenna(0) if several else truth,
        name=options.out,
        settings=settings,
        antennas=observation.received if several else None,
        antenna_spacing_wavelengths=array.spacing_wavelengths if several else None,
        antennas_truth=truth if several else None,
    )
    write_frame(options.out, frame)
    return 0


def _array(options: argparse.Namespace) -> UniformLinearArray:
    if options.antenna_spacing_wavelengths is None:
        return UniformLinearArray(num_antennas=options.antennas)
    return UniformLinearArray(
        num_antennas=options.antennas, spacing_wavelengths=options.antenna_spacing_wavelengths
    )


def _simulated(
    options: argparse.Namespace, array: UniformLinearArray
) -> tuple[Scenario, Observation]:
    if array.num_antennas == 1:
        return simulate_preset(
            options.preset,
            snr_db=options.snr_db,
            sir_db=options.sir_db,
            seed=options.seed,
            interference=not options.no_interference,
        )
    angle = options.interferer_angle_deg
    return simulate_preset_antennas(
        options.preset,
        array,
        snr_db=options.snr_db,
        sir_db=options.sir_db,
        seed=options.seed,
        object_angles_deg=_as_array(options.object_angles_deg),
        interferer_angles_deg=_as_array(None if angle is None else [angle]),
        interference=not options.no_interference,
    )


def _as_array(angles: list[float] | None) -> FloatArray | None:
    return None if angles is None else np.array(angles)
