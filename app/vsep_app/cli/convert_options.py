"""The options of ``vsep convert``; what it does stands in `vsep_app.cli.convert_commands`."""

import argparse
from typing import Any

_EXAMPLES = """\
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


def add_convert(commands: Any) -> None:
    """Add ``convert`` to the command line's commands."""
    parser = commands.add_parser(
        "convert",
        help="make a frame file of a sensor's recording",
        description="Make a frame file of a sensor's recording: MATLAB, NumPy, or a raw capture of "
        "a Texas Instruments card.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.set_defaults(command=_convert)
    parser.add_argument("recording", metavar="RAW", help="the recording")
    parser.add_argument(
        "--settings", required=True, metavar="FILE", help="what it is, *.json, *.yaml or *.yml"
    )
    parser.add_argument(
        "--frame", type=int, metavar="N", help="which frame of it, from 0, instead of the settings'"
    )
    parser.add_argument("--out", required=True, metavar="FILE", help="the frame file, *.npz")


def _convert(options: argparse.Namespace) -> int:
    from vsep_app.cli.convert_commands import convert_file

    return convert_file(options)
