"""``vsep convert``: a frame file of a sensor's recording."""

import argparse
import sys
from dataclasses import replace

from vsep.files.frame import write_frame
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import read_settings
from vsep_app.cli.shared_options import add_file, add_number, add_out, require_other_file

DESCRIPTION = (
    "Make a frame file of a sensor's recording: MATLAB, NumPy, or a raw capture of a Texas "
    "Instruments card."
)
EXAMPLES = """\
examples:
  vsep convert adc_data.bin --settings radar.yaml --out frame.npz
  vsep convert recording.mat --settings radar.json --frame 3 --out frame.npz

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
    add_file(parser, "--settings", "what it is, *.json, *.yaml or *.yml", required=True)
    add_number(parser, "--frame", "which frame of it, from 0, instead of the settings'", kind=int)
    add_out(parser, "the frame file, *.npz")


def run(options: argparse.Namespace) -> int:
    """Write the frame file of a recording; what looks wrong goes to standard error."""
    inputs = (options.recording, options.settings)
    require_other_file(options.out, inputs, "is the recording or its settings")
    settings = read_settings(options.settings)
    if options.frame is not None:
        settings = replace(settings, frame=options.frame)
    frame, remarks = convert_recording(options.recording, settings)
    write_frame(options.out, frame)
    for remark in remarks:
        sys.stderr.write(f"vsep: {remark}\n")
    return 0
