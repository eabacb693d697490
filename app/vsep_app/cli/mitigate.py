"""``vsep mitigate``: interfered samples repaired by the usual methods."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import frame_mask
from vsep.files.writing import write_npz
from vsep.mitigation.method import FrameArray, Mitigation, mitigate
from vsep.mitigation.registry import MITIGATIONS
from vsep.mitigation.sparse.operators import DOMAINS
from vsep.mitigation.sparse.prior import SeenFrame
from vsep.signal.clutter import remove_static_clutter
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.radar import ChirpSequence
from vsep_app.cli.estimator_options import add_mask_option
from vsep_app.cli.progress import counted, say
from vsep_app.cli.shared_options import (
    EXIT_INPUT,
    add_antenna_option,
    add_clutter_option,
    add_frames,
    add_out,
    error_text,
    given,
    listed,
    refuse_unused,
    require_distinct_names,
)

_SEQUENTIAL = listed([name for name, entry in MITIGATIONS.items() if entry.prior is not None])
DESCRIPTION = (
    f"Repair the interfered samples of frame files by one of the usual methods. For {_SEQUENTIAL} "
    "the frames are a sequence: what was found in the last three lowers thresholds in the next."
)
EXAMPLES = """\
examples:
  vsep mitigate frame.npz --method zeroing --out cleaned
  vsep mitigate night/*.npz --method mca-2d --mask autoregressive --out cleaned
  vsep mitigate drive-1.npz drive-2.npz drive-3.npz --method pm-ist --out cleaned
"""
_SETTINGS: Final = ("domain", "debias")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_frames(parser, "; in order")
    parser.add_argument("--method", required=True, metavar="NAME", help=", ".join(MITIGATIONS))
    add_mask_option(parser)
    add_antenna_option(parser)
    add_clutter_option(parser, "repaired like all others, or left out of it and put back")
    parser.add_argument(
        "--domain",
        choices=DOMAINS,
        help="how compressive sensing computes: two-dimensional masked residual updates, or the "
        f"explicit matrix for comparison (default: {DOMAINS[0]})",
    )
    parser.add_argument(
        "--debias", action="store_true", help="end compressive sensing by a least-squares fit"
    )
    add_out(parser, "folder, made if need be, for DIR/<frame>.npz with cleaned and mask", "DIR")


def run(options: argparse.Namespace) -> int:
    """Repair every frame, one file each; 2 if one of them could not be used."""
    repairs = _Repairs(options)
    _require_distinct(options.frames, options.out)
    Path(options.out).mkdir(parents=True, exist_ok=True)
    progress = counted(options.frames, len(options.frames), "frame")
    used = [_mitigate_frame(path, repairs, options) for path in progress]
    return 0 if all(used) else EXIT_INPUT


class _Repairs:
    """Repairs frame after frame; a method with a prior knows what it found in the last ones.

    A frame that cannot be used says nothing to the next, and one of another radar begins anew.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._entry = MITIGATIONS.require(options.method)
        self._settings = given(options, _SETTINGS)
        known = {name: frozenset(entry.settings) for name, entry in MITIGATIONS.items()}
        refuse_unused(self._settings, (self._entry.name,), known)
        self._make()  # refuses settings out of range before the first frame
        self._history: tuple[SeenFrame, ...] = ()
        self._radar: ChirpSequence | None = None

    def _make(
        self, history: tuple[SeenFrame, ...] | None = None, dither: RampDither | None = None
    ) -> Mitigation:
        settings = {**self._settings, **self._entry.accepted(dither=dither)}
        method: Mitigation = MITIGATIONS.make(self._entry.name, history=history, **settings)
        return method

    def cleaned(self, frame: Frame, received: ComplexArray, mask: BoolArray) -> FrameArray:
        """Return the repaired frame, or what of it is to be repaired."""
        prior, dither = self._entry.prior, frame.radar.dither
        if prior is None:
            return mitigate(self._make(dither=dither), received, mask).cleaned
        history = self._history if frame.radar == self._radar else ()
        cleaned = mitigate(self._make(history, dither), received, mask).cleaned
        self._history, self._radar = prior.see(history, cleaned, dither), frame.radar
        return cleaned


def _mitigate_frame(path: str, repairs: _Repairs, options: argparse.Namespace) -> bool:
    """Write the repaired frame of one file, in its sign and shape; False if it cannot be used."""
    try:
        frame = read_frame(path, antenna=options.antenna or 0)
        received = frame.received
        if options.clutter == "remove":
            received = remove_static_clutter(received, frame.name)
        mask = frame_mask(frame, options.mask, received)
        # What stands still is put back.
        cleaned = repairs.cleaned(frame, received, mask) + (frame.received - received)
        write_npz(
            _path_of(options.out, path),
            cleaned=frame.in_file_sign(np.asarray(cleaned, dtype=np.complex128)),
            mask=frame.in_file_shape(mask),
        )
    except (InputError, MemoryError) as error:
        sentence = error_text(path, error)
        say(sentence if path in sentence else f"{path}: {sentence}")
        return False
    return True


def _path_of(folder: str, frame: str) -> Path:
    return Path(folder) / f"{Path(frame).stem}.npz"


def _require_distinct(frames: Sequence[str], out: str) -> None:
    """Refuse outputs that would overwrite a frame or each other."""
    require_distinct_names(frames)
    outputs = {_path_of(out, frame).resolve() for frame in frames}
    if outputs & {Path(frame).resolve() for frame in frames}:
        raise InputError(f"--out {out} would overwrite a frame; give another folder.")
