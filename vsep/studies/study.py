"""Records of a study: its points, its settings, and one trial of it.

A trial is all that `vsep.studies.trial.run_trial` needs: its result depends on nothing else, so it
can be repeated alone, on any machine and in any order.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np

from vsep._validation import require_choice, require_range
from vsep.analysis.gospa import DEFAULT_CUTOFF, DEFAULT_ORDER
from vsep.errors import InputError
from vsep.inference.core.schedule import schedule_by_name
from vsep.mitigation.masks.detectors import DETECTORS
from vsep.parameters import PARAMETERS
from vsep.presets.registry import SCENES
from vsep.registry import Entry
from vsep.signal.simulate import INTERFERENCE_MODELS, InterferenceModel
from vsep.studies.panel_specs import AnySpec, PanelSpec

GapPrior: TypeAlias = Literal["own", "other"]
GapSource: TypeAlias = Literal["recovered", "original"]
GapThreshold: TypeAlias = Literal["own", "adaptive", "constant", "falling"]
GapDomain: TypeAlias = Literal["masked-2d", "explicit-1d"]
ExampleKind: TypeAlias = Literal["signals", "time-frequency", "maps"]
GAPS: Final = "sequence-with-gaps"
"""Scene of the studies of compressive sensing, see `vsep.studies.gap_frames`."""
DRAWN: Final = ("coloured-noise", "random-chirps", "semi-real", GAPS)
"""Scenes that are no preset, see `vsep.studies.drawn_scenes`."""
CHANGEABLE: Final = ("object_threshold_db", "false_alarm_rate", "interference_threshold_db")
"""Parameters of points that are settings of estimators: a run may have others."""
GAP_SETTINGS: Final = (
    *("num_ramps", "num_samples", "share_lost", "snr_db", "sir_db", "num_prior_frames", "prior"),
    *(
        "prior_source",
        "threshold",
        "control",
        "step_width",
        "samples_per_ramp",
        "debias",
        "mask",
        "domain",
    ),
)
"""The same of points of sequences with gaps."""
_MAX_DIGITS = 9  # of an index; longer ones are not read


@dataclass(frozen=True, kw_only=True, slots=True)
class Point:
    """One point of a study: a family of scenes and the threshold they are searched with."""

    panel: str  #: the part of the figure it belongs to, for example "3b"
    #: one of `vsep.presets.registry.SCENES`, a preset, a family of presets that take turns, or
    #: frames of noise alone of the size of a preset's; or one of `DRAWN`
    scene: str
    #: (25) and (26)
    snr_db: float
    sir_db: float
    #: the object threshold, or the rate that sets it; without both the estimator's default rate
    object_threshold_db: float | None = None
    false_alarm_rate: float | None = None
    #: T_beta of the estimators that have one; that of the schedule if None
    interference_threshold_db: float | None = None
    #: order of the true filter; 0 is the raised cosine that the estimators assume
    butterworth_order: int = 0
    interference_model: InterferenceModel = "multiplicative"  #: how the simulator makes the bursts
    num_interferers: int = 1  #: 1, or 2 for a burst of each in every interfered ramp
    #: 1, or 2 if two chirps of the second interferer cross in every interfered ramp
    num_second_crossings: int = 1
    interferer_slope_hz_per_s: float | None = None  #: another slope k_I than that of Table I
    #: in Simulation II: that many ramps in a row from the first on have a burst, in the place of
    #: those that Table I makes
    num_interfered_ramps: int | None = None
    num_objects: int | None = None  #: another number of objects than that of Table I
    object_delay_s: float | None = None  #: another delay of the first object
    #: half-amplitude frequency of the true filter, in the place of the preset's
    filter_cutoff_hz: float | None = None
    #: by which share of it the estimators take the cut-off for larger than it is
    filter_mismatch: float = 0.0
    cut_bursts: bool = False  #: whether bursts end where their frequency leaves the pass band
    rolled_ramps: int = 0  #: by how many ramps bursts are moved, around the end of the frame
    mask: str = "truth"  #: interfered samples that repairs get: those that are, or a detector's

    def __post_init__(self) -> None:
        """Check the names and the counts; the simulator and the estimators check the rest."""
        require_choice("scene", self.scene, (*SCENES, *DRAWN))
        require_choice("interference_model", self.interference_model, INTERFERENCE_MODELS)
        require_range("num_interferers", self.num_interferers, 1, 2)
        require_range("num_second_crossings", self.num_second_crossings, 1, self.num_interferers)
        require_range("butterworth_order", self.butterworth_order, 0, 16)
        require_choice("mask", self.mask, ("truth", *DETECTORS))
        require_range("filter_mismatch", self.filter_mismatch, -0.9, 9.0)

    def parameters(self) -> dict[str, Any]:
        """Return the parameters by name, as they stand in a row."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class GapPoint(Point):
    """A point of compressive sensing on sequences with gaps; SNR and SIR are of a sample."""

    #: size of the frames
    num_ramps: int = 256
    num_samples: int = 128
    share_lost: float = 0.5  #: of every ramp
    num_prior_frames: int = 3  #: Q: frames before the one that is judged
    prior: GapPrior = (
        "own"  #: whose frames a prior has seen: its own sequence's, or of other objects
    )
    prior_source: GapSource = "recovered"  #: whether it sees them recovered, or as received
    threshold: GapThreshold = "own"  #: that of the method, or another
    control: float | None = None  #: beta of (12), the method's if None
    step_width: float = 1.0  #: theta of (11)
    samples_per_ramp: int | None = None  #: p, drawn from the clean samples of a ramp; all if None
    debias: bool = False  #: whether a least-squares fit of the cells found follows
    domain: GapDomain = "masked-2d"  #: two-dimensional masked updates, or the explicit matrix

    def __post_init__(self) -> None:
        """Check the choices."""
        Point.__post_init__(self)
        for name, kind in (
            ("prior", GapPrior),
            ("prior_source", GapSource),
            ("threshold", GapThreshold),
            ("domain", GapDomain),
        ):
            require_choice(name, getattr(self, name), get_args(kind))
        require_range("share_lost", self.share_lost, 0.01, 0.95)
        require_range("num_prior_frames", self.num_prior_frames, 0, 100)


def point_of(parameters: Mapping[str, Any]) -> Point:
    """Return the point of parameters as they stand in a row."""
    return (GapPoint if "share_lost" in parameters else Point)(**parameters)


@dataclass(frozen=True, kw_only=True, slots=True)
class TrialSettings:
    """What all trials of a study have in common."""

    seed: int = 1  #: of the study
    schedule: str = "robust"  #: of the estimators that have one
    #: in resolution cells; decides what is a miss and a false alarm
    gospa_cutoff: float = DEFAULT_CUTOFF
    gospa_order: float = DEFAULT_ORDER  #: p of GOSPA

    def __post_init__(self) -> None:
        """Check the values."""
        PARAMETERS["seed"].require(self.seed, "seed")
        schedule_by_name(self.schedule)
        require_range("GOSPA cutoff", self.gospa_cutoff, 1e-6, 1e6, "cells")
        require_range("GOSPA order", self.gospa_order, 1.0, 100.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Trial:
    """One realisation of one point, with the methods to run on it."""

    study: str  #: name of the study
    point_index: int  #: position of the point in the study
    point: Point  #: the point itself
    realization: int  #: number of the realisation, from 0
    #: names of `vsep.studies.methods`; every one sees the same scene and noise
    methods: tuple[str, ...]
    settings: TrialSettings  #: common to the study
    #: methods that are not registered, see `vsep.studies.methods`
    handed: tuple[Entry, ...] = field(default=(), compare=False)

    @property
    def seed_sequence(self) -> np.random.SeedSequence:
        """The randomness of this trial: a function of study seed, point and realisation."""
        key = (self.point_index, self.realization)
        return np.random.SeedSequence(self.settings.seed, spawn_key=key)


@dataclass(frozen=True, kw_only=True, slots=True)
class Study:
    """A named set of points, with a number of realisations of each."""

    name: str  #: as the command line spells it
    title: str  #: one line for a reader
    points: tuple[Point, ...]  #: their order fixes their randomness: add new points at the end
    realizations: int  #: per point
    methods: tuple[str, ...]  #: names of `vsep.studies.methods`
    settings: TrialSettings = field(default_factory=TrialSettings)  #: seed, schedule, GOSPA
    selected: tuple[int, ...] | None = None  #: indices of the points to run; all by default
    handed: tuple[Entry, ...] = field(default=(), compare=False)  #: methods that are not registered
    panels: tuple[AnySpec, ...] = ()  #: what its figure shows
    #: what its figure shows of single realisations, where it shows no statistics
    example: ExampleKind | None = None

    def __post_init__(self) -> None:
        """Check the number of realisations and the selection."""
        require_range("realizations", self.realizations, 1, 10**9)
        for index in self.selected or ():
            require_range("point", index, 0, len(self.points) - 1)

    @property
    def curves(self) -> tuple[PanelSpec, ...]:
        """Panels of its figure that show a metric over a parameter."""
        return tuple(spec for spec in self.panels if isinstance(spec, PanelSpec))

    @property
    def changeable(self) -> tuple[str, ...]:
        """Parameters of its points that a run may have other values of."""
        gaps = all(isinstance(point, GapPoint) for point in self.points)
        return GAP_SETTINGS if gaps else CHANGEABLE

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

        Raises `InputError` if there is no such point, or the realisation is negative.
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

    Raises `InputError` if a part is neither a panel nor an index of a point.

    Returns ascending, each once.
    """
    panels = {point.panel for point in points}
    outside = InputError(
        f"points is {selection[:80]!r}; its indices must lie between 0 and {len(points) - 1}."
    )
    chosen: set[int] = set()
    for part in (part.strip() for part in selection.split(",")):
        first, dash, last = part.partition("-")
        if part in panels:
            chosen |= {index for index, point in enumerate(points) if point.panel == part}
        elif first.isdecimal() and (last.isdecimal() if dash else True):
            if max(len(first), len(last)) > _MAX_DIGITS or int(last or first) >= len(points):
                raise outside
            chosen |= set(range(int(first), int(last or first) + 1))
        else:
            raise InputError(
                f"points holds {part[:80]!r}; it must be one of the panels "
                f"{', '.join(sorted(panels))}, an index or a range such as 0-5."
            )
    if not chosen:
        raise outside
    return tuple(sorted(chosen))
