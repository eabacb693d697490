"""The frozen scenes of the bench.

A frame is a function of `VERSION`, its scene and its number: the bench is a study of the seed
`SEED`, whose points are the scenes. Nothing of a scene changes within a version; a test keeps the
energies of their frames. What becomes different gets a new version, and scenes are added at the
end.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from vsep.errors import InputError, shown
from vsep.studies.methods import NO_INTERFERENCE, read_methods
from vsep.studies.study import Point, Study, TrialSettings
from vsep.units import to_db

VERSION: Final = 1
SEED: Final = 20_240_523
FRAMES: Final = 12  # a scene, if nothing else is said
DEFAULT_METHODS: Final = (
    "factorised",
    "masked",
    "masked-autoregressive",
    "object-only",
    "zeroing",
    "autoregressive",
    "mca",
    "iht",
    NO_INTERFERENCE,
)
_VICTIM_SLOPE_HZ_PER_S = 1e13
_LONG_HZ_PER_S = 0.05e12  # two ramps within the pass band
_RAMP_SAMPLES_DB = float(to_db(256))  # from a level of one sample to that of a ramp


@dataclass(frozen=True, kw_only=True, slots=True)
class BenchScene:
    """One kind of scene."""

    name: str
    help: str  #: one sentence
    point: Point  #: how its frames are drawn


def _scene(name: str, help: str, scene: str, **levels: Any) -> BenchScene:
    usual = {"snr_db": 60.0, "sir_db": -20.0} | levels
    return BenchScene(name=name, help=help, point=Point(panel=name, scene=scene, **usual))


def _one_ramp(snr_db: float, inr_db: float) -> BenchScene:
    """Levels of a sample, as the papers on diffusion models have them."""
    return _scene(
        f"one-ramp-snr{snr_db:+.0f}-inr{inr_db:+.0f}",
        f"One ramp, random chirps, up to 30 targets; SNR {snr_db:g}, INR {inr_db:g} dB a sample.",
        "random-chirps",
        snr_db=snr_db + _RAMP_SAMPLES_DB,
        sir_db=snr_db - inr_db,
    )


SCENES: Final = (
    _scene(
        "simulation-1",
        "The paper's Simulation I at its worst level: one ramp, one object.",
        "simulation-1",
        snr_db=30.0,
        sir_db=-15.0,
    ),
    _scene("simulation-2-a", "The paper's Simulation II, two long bursts.", "simulation-2-a"),
    _scene("simulation-2-b", "The paper's Simulation II, four bursts.", "simulation-2-b"),
    _scene("simulation-2-c", "The paper's Simulation II, eight short bursts.", "simulation-2-c"),
    _scene(
        "long-bursts",
        "Simulation II with bursts that would fill two ramps.",
        "simulation-2",
        interferer_slope_hz_per_s=_VICTIM_SLOPE_HZ_PER_S - _LONG_HZ_PER_S,
    ),
    _scene(
        "dense-bursts",
        "Simulation II with a burst in each of its 16 ramps.",
        "simulation-2",
        num_interfered_ramps=16,
    ),
    _scene(
        "wrong-filter",
        "Bursts through a Butterworth filter of order 4; a raised cosine is assumed.",
        "simulation-2",
        butterworth_order=4,
        interference_model="convolution",
    ),
    _scene(
        "coloured-noise",
        "Noise that rises by 10 dB towards beat frequency zero.",
        "coloured-noise",
    ),
    _scene(
        "ramp-edges",
        "Exact convolution with the edges of the interferer's ramps.",
        "simulation-2",
        interference_model="convolution-with-edges",
    ),
    _scene(
        "several-interferers",
        "Two interferers, three bursts in every interfered ramp.",
        "simulation-2",
        num_interferers=2,
        num_second_crossings=2,
    ),
    _scene(
        "semi-real",
        "A recorded frame with simulated bursts through a receiver that is not known; objects "
        "count against those found in the frame before the bursts.",
        "semi-real",
        snr_db=40.0,
    ),
    *(_one_ramp(snr_db, inr_db) for snr_db in (-20.0, 0.0) for inr_db in (0.0, 10.0, 20.0)),
)
"""All scenes in their order, which is part of the version."""


def bench_study(
    *,
    scenes: Iterable[str] | None = None,
    methods: Iterable[Any] = DEFAULT_METHODS,
    frames: int = FRAMES,
) -> Study:
    """Return the bench as a study: `vsep.record_study` runs it, resumes it, and uses a cluster.

    Parameters
    ----------
    scenes : iterable of str, optional
        Names of `SCENES`; all by default.
    methods : iterable
        As of `vsep.studies.methods.read_methods`: names, methods, classes, entries.
    frames : int
        Of every scene.

    Raises
    ------
    InputError
        If a scene or a method is unknown, or there are no frames.

    Examples
    --------
    >>> study = bench_study(scenes=["semi-real"], methods=["masked"], frames=2)
    >>> study.name, study.num_rows
    ('bench-1', 2)
    """
    names = [scene.name for scene in SCENES]
    chosen = names if scenes is None else list(dict.fromkeys(scenes))
    for name in chosen:
        if name not in names:
            raise InputError(f"scene is {shown(name)}; it must be one of {', '.join(names)}.")
    given = read_methods(methods)
    study = Study(
        name=f"bench-{VERSION}",
        title="Frozen scenes for any method",
        points=tuple(scene.point for scene in SCENES),
        realizations=frames,
        methods=given.names,
        handed=given.handed,
        settings=TrialSettings(seed=SEED),
    )
    return replace(study, selected=tuple(sorted(names.index(name) for name in chosen)))


def fingerprint(received: Any) -> float:
    """Mean power of a frame, which tells whether a frozen scene is still itself.

    Examples
    --------
    >>> fingerprint([[1.0, 2.0j]])
    2.5
    """
    return float(np.mean(np.abs(np.asarray(received)) ** 2))
