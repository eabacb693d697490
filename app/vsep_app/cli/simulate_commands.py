"""What ``vsep simulate`` does once its options are read."""

import argparse
from pathlib import Path

import numpy as np

from vsep._typing import FloatArray
from vsep.errors import InputError
from vsep.files.frame import Frame, write_frame
from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.registry import simulated_preset
from vsep.presets.scenes import Scenario, simulate_preset
from vsep.signal.linear_array import UniformLinearArray
from vsep.signal.scene import Observation

_SPACING_WAVELENGTHS = 0.5
_OF_SEVERAL = ("antenna_spacing_wavelengths", "object_angles_deg", "interferer_angle_deg")


def simulate_frame(options: argparse.Namespace) -> int:
    """Simulate a preset and write its frame file."""
    folder = Path(options.out).parent
    if not folder.is_dir():
        raise InputError(f"{options.out} cannot be written: {folder} is no folder; make it first.")
    if options.snr_db is None:
        options.snr_db = simulated_preset(options.preset).snr_db
    if options.sir_db is None:
        options.sir_db = simulated_preset(options.preset).sir_db
    settings = {
        "preset": options.preset,
        "snr_db": repr(options.snr_db),
        "seed": str(options.seed),
    }
    if not options.no_interference:
        settings["sir_db"] = repr(options.sir_db)
    several = options.antennas > 1
    line = _antenna_line(options)
    scenario, observation = _simulated(options, line)
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
        antenna_spacing_wavelengths=line.spacing_wavelengths if several else None,
        antennas_truth=truth if several else None,
    )
    write_frame(options.out, frame)
    return 0


def _antenna_line(options: argparse.Namespace) -> UniformLinearArray:
    """Return the antennas; `InputError` for settings that one antenna has no use for."""
    if options.antennas == 1:
        for name in _OF_SEVERAL:
            if getattr(options, name) is not None:
                option = "--" + name.replace("_", "-")
                raise InputError(f"--antennas is 1; {option} needs at least 2.")
    spacing = options.antenna_spacing_wavelengths
    return UniformLinearArray(
        num_antennas=options.antennas,
        spacing_wavelengths=_SPACING_WAVELENGTHS if spacing is None else spacing,
    )


def _simulated(
    options: argparse.Namespace, line: UniformLinearArray
) -> tuple[Scenario, Observation]:
    if line.num_antennas == 1:
        return simulate_preset(
            options.preset,
            snr_db=options.snr_db,
            sir_db=options.sir_db,
            seed=options.seed,
            interference=not options.no_interference,
        )
    angle = options.interferer_angle_deg
    if options.no_interference and angle is not None:
        raise InputError("--no-interference leaves out whose --interferer-angle-deg is given.")
    return simulate_preset_antennas(
        options.preset,
        line,
        snr_db=options.snr_db,
        sir_db=options.sir_db,
        seed=options.seed,
        object_angles_deg=_list(options.object_angles_deg),
        interferer_angles_deg=_list(None if angle is None else [angle]),
        interference=not options.no_interference,
    )


def _list(angles: list[float] | None) -> FloatArray | None:
    return None if angles is None else np.array(angles)
