"""Records of a study: its points, its settings, and one trial of it.

A trial is all that `vsep.studies.trial.run_trial` needs: its result depends on nothing else, so it
can be repeated alone, on any machine and in any order.
"""

from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias, get_args

import numpy as np

from vsep._validation import require_range
from vsep.analysis.gospa import DEFAULT_CUTOFF, DEFAULT_ORDER
from vsep.errors import InputError
from vsep.inference.core.schedule import schedule_by_name
from vsep.registry import Entry
from vsep.signal.simulate import INTERFERENCE_MODELS, InterferenceModel

SceneName: TypeAlias = Literal[
    "simulation-1",
    "simulation-2",
    "noise-1",
    "noise-2",
    "simulation-2-a",
    "simulation-2-b",
    "simulation-2-c",
]
SCENE_NAMES: tuple[SceneName, ...] = get_args(SceneName)
MAX_SEED = 2**63 - 1


@dataclass(frozen=True, kw_only=True, slots=True)
class Point:
    """One point of a study: a family of scenes and the threshold they are searched with.

    Parameters
    ----------
    panel : str
        The part of the figure it belongs to, for example "3b".
    scene : str
        One of `SCENE_NAMES`. "simulation-2" takes its three parameter sets in turn; "noise-1" and
        "noise-2" are frames of noise alone, of the sizes of Simulation I and II.
    snr_db, sir_db : float
        (25) and (26).
    object_threshold_db, false_alarm_rate : float, optional
        The object threshold, or the rate that sets it; without both the estimator's default rate.
    butterworth_order : int
        Order of the true filter; 0 is the raised cosine that the estimators assume.
    interference_model : str
        How the simulator makes the bursts.
    num_interferers : int
        1, or 2 for a burst of each in every interfered ramp.
    num_second_crossings : int
        1, or 2 if two chirps of the second interferer cross in every interfered ramp.
    interferer_slope_hz_per_s : float, optional
        Another slope k_I than that of Table I.
    num_interfered_ramps : int, optional
        In Simulation II: that many ramps in a row from the first on have a burst, in the place of
        those that Table I makes.
    num_objects : int, optional
        Another number of objects than that of Table I.
    object_delay_s : float, optional
        Another delay of the first object.
    filter_cutoff_hz : float, optional
        Half-amplitude frequency of the true filter, in the place of the preset's.
    filter_mismatch : float
        By which share of it the estimators take the cut-off for larger than it is.
    """

    panel: str
    scene: SceneName
    snr_db: float
    sir_db: float
    object_threshold_db: float | None = None
    false_alarm_rate: float | None = None
    butterworth_order: int = 0
    interference_model: InterferenceModel = "multiplicative"
    num_interferers: int = 1
    num_second_crossings: int = 1
    interferer_slope_hz_per_s: float | None = None
    num_interfered_ramps: int | None = None
    num_objects: int | None = None
    object_delay_s: float | None = None
    filter_cutoff_hz: float | None = None
    filter_mismatch: float = 0.0

    def __post_init__(self) -> None:
        """Check the names and the counts; the simulator and the estimators check the rest."""
        if self.scene not in SCENE_NAMES:
            allowed = ", ".join(SCENE_NAMES)
            raise InputError(f"scene is {self.scene!r}; it must be one of {allowed}.")
        if self.interference_model not in INTERFERENCE_MODELS:
            allowed = ", ".join(INTERFERENCE_MODELS)
            raise InputError(
                f"interference_model is {self.interference_model!r}; it must be one of {allowed}."
            )
        require_range("num_interferers", self.num_interferers, 1, 2)
        require_range("num_second_crossings", self.num_second_crossings, 1, self.num_interferers)
        require_range("butterworth_order", self.butterworth_order, 0, 16)
        require_range("filter_mismatch", self.filter_mismatch, -0.9, 9.0)

    def parameters(self) -> dict[str, Any]:
        """Return the parameters by name, as they stand in a row."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrialSettings:
    """What all trials of a study have in common.

    Parameters
    ----------
    seed : int
        Of the study.
    schedule : {"robust", "paper"}
        Of the estimators that have one.
    gospa_cutoff : float
        In resolution cells; decides what is a miss and a false alarm.
    gospa_order : float
        p of GOSPA.
    """

    seed: int = 1
    schedule: str = "robust"
    gospa_cutoff: float = DEFAULT_CUTOFF
    gospa_order: float = DEFAULT_ORDER

    def __post_init__(self) -> None:
        """Check the values."""
        require_range("seed", self.seed, 0, MAX_SEED)
        schedule_by_name(self.schedule)
        require_range("GOSPA cutoff", self.gospa_cutoff, 1e-6, 1e6, "cells")
        require_range("GOSPA order", self.gospa_order, 1.0, 100.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Trial:
    """One realisation of one point, with the methods to run on it.

    Parameters
    ----------
    study : str
        Name of the study.
    point_index : int
        Position of the point in the study.
    point : Point
        The point itself.
    realization : int
        Number of the realisation, from 0.
    methods : tuple of str
        Names of `vsep.studies.methods`; every one sees the same scene and noise.
    settings : TrialSettings
        Common to the study.
    handed : tuple of Entry
        Methods that are not registered, see `vsep.studies.methods`.
    """

    study: str
    point_index: int
    point: Point
    realization: int
    methods: tuple[str, ...]
    settings: TrialSettings
    handed: tuple[Entry, ...] = field(default=(), compare=False)

    @property
    def seed_sequence(self) -> np.random.SeedSequence:
        """The randomness of this trial: a function of study seed, point and realisation."""
        key = (self.point_index, self.realization)
        return np.random.SeedSequence(self.settings.seed, spawn_key=key)


@dataclass(frozen=True, kw_only=True, slots=True)
class Study:
    """A named set of points, with a number of realisations of each.

    Parameters
    ----------
    name : str
        As the command line spells it.
    title : str
        One line for a reader.
    points : tuple of Point
        Their order fixes their randomness: add new points at the end.
    realizations : int
        Per point.
    methods : tuple of str
        Names of `vsep.studies.methods`.
    settings : TrialSettings
        Seed, schedule, GOSPA.
    selected : tuple of int, optional
        Indices of the points to run; all by default.
    handed : tuple of Entry
        Methods that are not registered.
    """

    name: str
    title: str
    points: tuple[Point, ...]
    realizations: int
    methods: tuple[str, ...]
    settings: TrialSettings = field(default_factory=TrialSettings)
    selected: tuple[int, ...] | None = None
    handed: tuple[Entry, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Check the number of realisations and the selection."""
        require_range("realizations", self.realizations, 1, 10**9)
        for index in self.selected or ():
            require_range("point", index, 0, len(self.points) - 1)

    @property
    def point_indices(self) -> tuple[int, ...]:
        """Indices of the points to run."""
        return tuple(range(len(self.points))) if self.selected is None else self.selected

    @property
    def num_rows(self) -> int:
        """Number of rows of the finished study."""
        return len(self.point_indices) * self.realizations * len(self.methods)

    def trial(self, point_index: int, realization: int) -> Trial:
        """Return one trial, whether or not it is among those to run.

        Raises
        ------
        InputError
            If there is no such point, or the realisation is negative.
        """
        require_range("point", point_index, 0, len(self.points) - 1)
        require_range("realization", realization, 0, 2**32 - 1)
        return Trial(
            study=self.name,
            point_index=point_index,
            point=self.points[point_index],
            realization=realization,
            methods=self.methods,
            settings=self.settings,
            handed=self.handed,
        )


def select_points(points: tuple[Point, ...], selection: str) -> tuple[int, ...]:
    """Read a selection such as ``"3b,0,40-51"``: panels, indices and ranges of indices.

    Returns
    -------
    tuple of int
        Ascending, each once.

    Raises
    ------
    InputError
        If a part is neither a panel nor an index of a point.
    """
    panels = {point.panel for point in points}
    chosen: set[int] = set()
    for part in (part.strip() for part in selection.split(",")):
        first, dash, last = part.partition("-")
        if part in panels:
            chosen |= {index for index, point in enumerate(points) if point.panel == part}
        elif first.isdecimal() and (last.isdecimal() if dash else True):
            chosen |= set(range(int(first), int(last or first) + 1))
        else:
            raise InputError(
                f"points holds {part!r}; it must be one of the panels {', '.join(sorted(panels))}, "
                "an index or a range such as 0-5."
            )
    if not chosen or max(chosen) >= len(points):
        raise InputError(
            f"points is {selection!r}; its indices must lie between 0 and {len(points) - 1}."
        )
    return tuple(sorted(chosen))
