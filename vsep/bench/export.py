"""The open set: frames of the bench as frame files, each with truth and mask, and a data sheet.

Everything in it is a function of the bench's version: whoever has the program makes the files that
are shipped, `fingerprint` tells whether they are the same.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from vsep._version import __version__
from vsep.bench.scenes import SCENES, SEED, VERSION, bench_study, fingerprint
from vsep.files.frame import Frame, write_frame
from vsep.files.writing import write_text
from vsep.studies.frames import trial_frame

OPEN_SET: Final = (
    "semi-real",
    "wrong-filter",
    "coloured-noise",
    "ramp-edges",
    "several-interferers",
    "long-bursts",
    "dense-bursts",
)
"""Scenes of the open set: the recorded frame with bursts, and what real sensors do to frames."""
SHEET: Final = "datasheet.md"


def export_frames(folder: Path, *, scenes: Sequence[str] = OPEN_SET, frames: int = 1) -> list[Path]:
    """Write frames of the bench and their data sheet into a folder.

    Parameters
    ----------
    folder : Path
        Made if need be.
    scenes : sequence of str
        Names of `vsep.bench.scenes.SCENES`.
    frames : int
        Of every scene.

    Returns
    -------
    list of Path
        The frame files; they have the truth and the mask, and a clean frame beside each.

    Raises
    ------
    InputError
        If a scene is unknown.
    OSError
        If a file cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    study = bench_study(scenes=scenes, frames=frames)
    lines, paths = [], []
    for index in study.point_indices:
        for number in range(frames):
            trial = study.trial(index, number)
            name = f"{SCENES[index].name}-{number}"
            frame = trial_frame(trial, "factorised")
            assert frame.truth is not None  # drawn
            whole = replace(frame, name=name, truth_mask=frame.truth.perfect_mask())
            paths.append(_write(folder / f"{name}.npz", whole))
            lines.append(f"| `{name}.npz` | {_size(whole)} | {fingerprint(whole.received):.9g} |")
    write_text(folder / SHEET, _sheet(study.point_indices, lines))
    return paths


def _write(path: Path, frame: Frame) -> Path:
    write_frame(path, frame)
    return path


def _size(frame: Frame) -> str:
    ramps, samples = frame.radar.shape
    return f"{ramps} x {samples}"


def _sheet(indices: Sequence[int], lines: Sequence[str]) -> str:
    """Say what the set is, as a data sheet does."""
    scenes = "\n".join(f"- `{SCENES[index].name}`: {SCENES[index].help}" for index in indices)
    files = "\n".join(lines)
    return f"""# Frames with mutual interference

**What for.** To develop and compare methods against mutual interference of FMCW radars, with the
truth at hand.

**What is in it.** Frame files (`.npz`, NumPy, no pickles): `received`, (ramps, samples) complex in
the sign exp(-j 2 pi f n); the radar's settings; `truth_beat`, `truth_doppler`, `truth_amplitude` of
the objects; `truth_object_signal` and `truth_interference_signal`, whose sum with the noise is
`received`; `truth_mask`, True where the interference exceeds the noise; and the filter that an
estimator is to assume, which in `wrong-filter` and `semi-real` is not the true one.

{scenes}

**How it was made.** By `vsep bench --export DIR`, vsep {__version__}, scenes of version {VERSION},
seed {SEED}. The same command makes the same files; the mean power of `received` tells.

| file | ramps x samples | mean power |
| --- | --- | --- |
{files}

**What it is not.** The bursts are simulated, all of them. In `semi-real` the frame below the bursts
is recorded: one person and clutter in a room; its objects are those that an estimator finds before
the bursts come, no survey. No frame shows traffic, and none identifies anybody.

**Licence.** The simulated frames are in the public domain (CC0 1.0). `semi-real` holds a frame of
OpenRadar by PreSenseRadar (commit 65bcd62, "doppler_example_1.npy"), licensed under the Apache
License, Version 2.0, changed by adding bursts; what was added is under CC BY 4.0, the vsep
contributors.
"""
