"""``vsep calibrate``: the receiver's response from the bursts in frame files."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vsep.calibration.calibrate import Calibration, calibrate
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.response_file import write_response
from vsep.units import to_db
from vsep_app.cli.shared_options import (
    add_number,
    add_out,
    require_folder,
    require_other_file,
)

DESCRIPTION = (
    "Estimate the receiver's complex response from the bursts in frame files of one receiver, and "
    "say how well it reproduces them."
)
EXAMPLES = """\
examples:
  vsep calibrate drive.npz --out response.npz
  vsep calibrate drive-1.npz drive-2.npz --slope-difference 19.312e12 --out response.npz
  vsep separate night.npz --response response.npz --out night.jsonl
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("frames", nargs="+", metavar="RECORDING", help="a frame file, *.npz")
    add_number(
        parser,
        "--slope-difference",
        "slope at which the bursts sweep in the frame files, Hz/s, where it is known "
        "(default: estimated from the bursts)",
    )
    add_out(parser, "the response file, *.npz, for separate")


def run(options: argparse.Namespace) -> int:
    """Estimate the response from all frames together, write it, and print how well it fits."""
    require_folder(options.out)
    require_other_file(options.out, options.frames, "is one of the recordings")
    frames = [read_frame(path) for path in options.frames]
    for path, frame in zip(options.frames, frames, strict=True):
        _require_same_receiver(path, frame, frames[0])
    beat_sign = frames[0].beat_sign
    slope = options.slope_difference
    if slope is not None and beat_sign == 1:
        slope = -slope  # conjugated on reading
    calibration = calibrate(
        [_antennas(frame) for frame in frames], frames[0].radar.sample_rate_hz, slope
    )
    write_response(
        options.out,
        calibration.estimate.response,
        beat_sign=beat_sign,
        sources=[Path(path).name for path in options.frames],
    )
    sys.stdout.write("\n".join(calibration_lines(calibration, beat_sign)) + "\n")
    return 0


def calibration_lines(calibration: Calibration, beat_sign: int) -> list[str]:
    """Return what a user reads of a calibration."""
    response = calibration.estimate.response
    parametric = calibration.parametric
    errors = to_db(np.median([fit.errors for fit in calibration.estimate.fits], axis=0))
    slope = -beat_sign * response.slope_difference_hz_per_s
    lines = [
        f"bursts              {response.num_bursts} of {len(calibration.windows)}",
        f"slope difference    {slope / 1e12:.4f} MHz/us",
        f"NMSE per burst      {_listed(errors)} dB, median by antenna (gain, delay, slope free)",
        f"delay               {_listed(1e9 * response.delays_s)} ns by antenna",
        f"parametric form     {_listed(to_db(parametric.errors))} dB from the response, by antenna",
        f"  high-pass         {parametric.high_pass_hz / 1e6:.4f} MHz, order 2",
        f"  low-pass          {parametric.low_pass_hz / 1e6:.4f} MHz, order 10",
        "  sections          b2 s^2 + b1 s + b0 over a2 s^2 + a1 s + a0",
    ]
    return lines + [
        "    " + " ".join(f"{value:.6g}" for value in section) for section in parametric.sections
    ]


def _listed(values: Sequence[float] | np.ndarray) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _antennas(frame: Frame) -> "np.ndarray":
    return frame.received[None] if frame.antennas is None else frame.antennas


def _require_same_receiver(path: str, frame: Frame, first: Frame) -> None:
    if (frame.radar.sample_rate_hz, frame.beat_sign) != (
        first.radar.sample_rate_hz,
        first.beat_sign,
    ):
        raise InputError(
            f"{path} has sample rate {frame.radar.sample_rate_hz:g} Hz and beat_sign "
            f"{frame.beat_sign}; the first recording's are {first.radar.sample_rate_hz:g} Hz and "
            f"{first.beat_sign}, and one receiver's all have the same."
        )
