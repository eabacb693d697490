"""What ``vsep mitigate`` does once its options are read."""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from vsep._typing import BoolArray
from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame
from vsep.files.frame_mask import frame_mask
from vsep.mitigation.method import FrameArray, Mitigation, mitigate
from vsep.mitigation.registry import MITIGATIONS
from vsep.mitigation.sparse.prior import SeenFrame
from vsep.signal.radar import ChirpSequence

_EXIT_INPUT = 2


def mitigate_frames(options: argparse.Namespace) -> int:
    """Repair every frame, one file each; 2 if one of them could not be used."""
    repairs = _Repairs(options)
    _require_distinct(options.frames, options.out)
    Path(options.out).mkdir(parents=True, exist_ok=True)
    # tqdm draws nothing by itself (None) where standard error is no terminal.
    quiet = None if len(options.frames) > 1 else True
    progress = tqdm(options.frames, unit="frame", disable=quiet)
    used = [_mitigate_frame(path, repairs, options) for path in progress]
    return 0 if all(used) else _EXIT_INPUT


class _Repairs:
    """Repairs frame after frame; a method with a prior knows what it found in the last ones.

    A frame that cannot be used says nothing to the next, and one of another radar begins anew.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._entry = MITIGATIONS.require(options.method)
        self._settings = {"domain": options.domain, "debias": options.debias}
        self._method = self._make()
        self._history: tuple[SeenFrame, ...] = ()
        self._radar: ChirpSequence | None = None

    def _make(self, history: tuple[SeenFrame, ...] | None = None) -> Mitigation:
        method: Mitigation = MITIGATIONS.make(self._entry.name, history=history, **self._settings)
        return method

    def cleaned(self, frame: Frame, mask: BoolArray) -> FrameArray:
        """Return the repaired frame."""
        prior = self._entry.prior
        if prior is None:
            return mitigate(self._method, frame.received, mask).cleaned
        history = self._history if frame.radar == self._radar else ()
        cleaned = mitigate(self._make(history), frame.received, mask).cleaned
        self._history, self._radar = prior.see(history, cleaned), frame.radar
        return cleaned


def _mitigate_frame(path: str, repairs: _Repairs, options: argparse.Namespace) -> bool:
    """Write the repaired frame of one file, in its sign and shape; False if it cannot be used."""
    try:
        frame = read_frame(path, antenna=options.antenna or 0)
        mask = frame_mask(frame, options.mask)
        cleaned = repairs.cleaned(frame, mask)
        np.savez(
            _path_of(options.out, path),
            cleaned=frame.in_file_sign(np.asarray(cleaned, dtype=np.complex128)),
            mask=frame.in_file_shape(mask),
        )
    except (InputError, MemoryError) as error:
        # A MemoryError carries no text.
        sentence = str(error) or f"{path} needs more memory than this machine has."
        sentence = sentence if path in sentence else f"{path}: {sentence}"
        tqdm.write(f"vsep: {sentence}", file=sys.stderr)
        return False
    return True


def _path_of(folder: str, frame: str) -> Path:
    return Path(folder) / f"{Path(frame).stem}.npz"


def _require_distinct(frames: Sequence[str], out: str) -> None:
    """Refuse outputs that would overwrite a frame or each other."""
    counts = Counter(Path(frame).stem for frame in frames)
    twice = [stem for stem, count in counts.items() if count > 1]
    if twice:
        raise InputError(f"{counts[twice[0]]} frames are named {twice[0]}; names must be distinct.")
    outputs = {_path_of(out, frame).resolve() for frame in frames}
    if outputs & {Path(frame).resolve() for frame in frames}:
        raise InputError(f"--out {out} would overwrite a frame; give another folder.")
