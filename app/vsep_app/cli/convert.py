"""``vsep convert``: a frame file of a sensor's recording."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.recordings.configurations.consequences import consequences, lines_of
from vsep.recordings.configurations.registry import (
    completed,
    for_recording,
    merged,
    read_configuration_file,
    settings_of,
    told_by,
)
from vsep.recordings.convert import convert_recording
from vsep.recordings.guess import Guess, guess_layouts
from vsep.recordings.readers import format_of_name
from vsep.recordings.settings_text import settings_text
from vsep.recordings.sigmf_files import META, write_sigmf
from vsep.recordings.suggest import suggest_settings
from vsep_app.cli.shared_options import add_file, add_number, require_other_file

DESCRIPTION = (
    "Make a frame file of a sensor's recording: MATLAB, NumPy, HDF5, SigMF, or a raw capture of a "
    "Texas Instruments card, also in a ROS bag."
)
EXAMPLES = """\
examples:
  vsep convert adc_data.bin --settings radar.yaml --out frame.npz
  vsep convert adc_data.bin --settings radar.cfg --out frame.npz
  vsep convert recording.mat --settings radar.json --frame 3 --out frame.npz
  vsep convert adc_data.bin
  vsep convert adc_data.bin --guess --settings radar.cfg --out frame.npz

Without settings the three most plausible layouts of a raw capture are printed with what speaks for
them; --guess completes settings that leave the layout open by the first one.

A settings file names the format and the radar's values, for example

  format: dca1000-xwr16xx
  start_frequency_hz: 77e9
  slope_hz_per_s: 29.982e12
  sample_rate_hz: 10e6
  ramp_period_s: 60e-6
  num_samples: 256
  num_ramps: 128
  num_antennas: 4

assets/docs/recordings.md explains all of them. What looks wrong is said on standard error.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("recording", metavar="RAW", help="the recording")
    add_file(
        parser,
        "--settings",
        "what it is, *.yaml or *.json, or the configuration of the sensor: *.cfg, *.lua, "
        "*.mmwave.json, LogFile.txt, config.json; given again, later ones count",
        default=[],
        action="append",
    )
    parser.add_argument(
        "--guess",
        action="store_true",
        help="guess what the settings leave open of a raw capture's layout (format, samples, "
        "counts of samples, antennas and transmitters) and print the three best layouts",
    )
    add_number(parser, "--frame", "which frame of it, from 0, instead of the settings'", kind=int)
    add_file(parser, "--out", "the frame file, *.npz, or in SigMF, *.sigmf-meta")


def run(options: argparse.Namespace) -> int:
    """Write the frame file of a recording; what looks wrong goes to standard error.

    Of a configuration every number is printed with its source, and what follows.
    """
    inputs = (options.recording, *options.settings)
    if options.out is not None:
        require_other_file(options.out, inputs, "is the recording or its settings")
    said = merged({path: read_configuration_file(path) for path in options.settings})
    if not options.settings and format_of_name(options.recording) is not None:
        said = told_by(suggest_settings(options.recording, options.recording), options.recording)
    elif options.guess or not options.settings:
        guesses = guess_layouts(
            options.recording, skip_bytes=_skipped(said.values), topic=said.values.get("key")
        )
        sys.stdout.writelines(f"{line}\n" for line in _lines_of_guesses(guesses))
        said = completed(said, guesses[0])
    if options.out is None:
        return _without_output(options)
    said = for_recording(said, options.recording)
    settings = settings_of(said, options.recording, ", ".join(options.settings) or "no --settings")
    if options.frame is not None:
        settings = replace(settings, frame=options.frame)
    frame, remarks = convert_recording(options.recording, settings)
    if options.out.endswith(META):
        write_sigmf(options.out, frame)
    else:
        write_frame(options.out, frame)
    for line in (*lines_of(said), *consequences(frame.radar, settings)):
        sys.stdout.write(f"{line}\n")
    for remark in (*said.remarks, *remarks):
        sys.stderr.write(f"vsep: {remark}\n")
    return 0


def _without_output(options: argparse.Namespace) -> int:
    """Say that nothing was written; only guesses may be asked for alone."""
    if options.settings and not options.guess:
        raise InputError("Nothing to write is named; give --out, or --guess.")
    return 0


def _skipped(values: Mapping[str, Any]) -> int:
    skipped = values.get("skip_bytes")
    return skipped if isinstance(skipped, int) and skipped > 0 else 0


def _lines_of_guesses(guesses: Sequence[Guess]) -> list[str]:
    lines = []
    for number, guess in enumerate(guesses, start=1):
        lines += [f"{number}. {guess}", f"   {guess.evidence}"]
    best = guesses[0]
    if "num_ramps" not in best.settings:
        lines.append(f"{best.num_ramps} ramps are taken for one frame; say num_ramps if not.")
    return [*lines, "settings of the first:", *settings_text(best.settings).splitlines()]
