"""What ``vsep convert`` does once its options are read."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from vsep.errors import InputError
from vsep.files.frame import write_frame
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import read_settings


def convert_file(options: argparse.Namespace) -> int:
    """Write the frame file of a recording; what looks wrong goes to standard error."""
    if Path(options.out).resolve() in {
        Path(options.recording).resolve(),
        Path(options.settings).resolve(),
    }:
        raise InputError(f"--out {options.out} is the recording or its settings; give another.")
    settings = read_settings(options.settings)
    if options.frame is not None:
        settings = replace(settings, frame=options.frame)
    frame, remarks = convert_recording(options.recording, settings)
    write_frame(options.out, frame)
    for remark in remarks:
        sys.stderr.write(f"vsep: {remark}\n")
    return 0
