"""``vsep add-bursts``: bursts of one measurement in the frame of another."""

import argparse
from dataclasses import replace

from vsep.calibration.burst_transfer import (
    HIGH_PASS_HZ,
    LOW_PASS_HZ,
    measured_bursts,
    transferred_frame,
)
from vsep.files.frame import read_frame, write_frame
from vsep.files.frame_mask import frame_mask
from vsep_app.cli.estimator_options import add_mask_option
from vsep_app.cli.shared_options import (
    add_file,
    add_number,
    add_out,
    require_folder,
    require_other_file,
)

DESCRIPTION = (
    "Put the bursts that one measurement received into the frame of another, as the paper's "
    "Appendix C does: the measurement is of a static scene, its mean over ramps that are not hit "
    "is subtracted, the bursts pass a high-pass and a low-pass that an estimator is to assume."
)
EXAMPLES = """\
examples:
  vsep add-bursts street.npz --bursts office.npz --out test.npz
  vsep add-bursts street.npz --bursts office.npz --low-pass 5 --sir-db -20 --out test.npz
"""
_HZ = 1e6


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    parser.add_argument("frame", metavar="FRAME", help="a frame file without interference, *.npz")
    add_file(
        parser,
        "--bursts",
        "a frame file of a static scene with interference, of the same size and sampling",
        required=True,
    )
    add_mask_option(parser)
    for option, value, kind in (
        ("--high-pass", HIGH_PASS_HZ, "high-pass"),
        ("--low-pass", LOW_PASS_HZ, "low-pass"),
    ):
        add_number(
            parser,
            option,
            f"MHz, -3 dB of the {kind} (default: {value / _HZ:g})",
            default=value / _HZ,
        )
    add_number(parser, "--sir-db", "frame over bursts, of energies (default: as measured)")
    add_out(parser, "the frame file, *.npz, with mask and the filter to assume")


def run(options: argparse.Namespace) -> int:
    """Make the frame."""
    require_folder(options.out)
    require_other_file(options.out, (options.frame, options.bursts), "would overwrite a frame")
    frame, measured = read_frame(options.frame), read_frame(options.bursts)
    mask = frame_mask(measured, options.mask, measured.received)
    made = transferred_frame(
        frame.received,
        measured_bursts(measured.received, mask),
        frame.radar.sample_rate_hz,
        high_pass_hz=options.high_pass * _HZ,
        low_pass_hz=options.low_pass * _HZ,
        sir_db=options.sir_db,
    )
    whole = replace(
        frame,
        received=made.received,
        truth=made.truth,
        truth_mask=made.truth.perfect_mask(),
        anti_aliasing_filter=made.anti_aliasing_filter,
    )
    write_frame(options.out, whole)
    return 0
