"""Figures that the reproduction makes: studies with their extent, quick and full.

Seconds are those of one core of a machine of 2023; they say how long a run takes, nothing else.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

from vsep.errors import InputError, shown
from vsep.studies.catalogue import make_study
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import Study, TrialSettings

Extent: TypeAlias = Literal["quick", "full"]
VSEP: Final = "Variational signal separation"
MRU: Final = "2-D masked residual updates"
OWN: Final = "The document on mitigation"


@dataclass(frozen=True, kw_only=True, slots=True)
class Figure:
    """A figure of a source, or what takes its place where a text has numbers and no figure."""

    name: str  #: as the command line spells it
    source: str
    title: str
    study: str  #: of the catalogue
    #: points of it, all by default, and methods, the study's by default
    points: str | None = None
    methods: tuple[str, ...] | None = None
    #: realisations a point
    quick: int
    full: int
    seconds: float  #: of one realisation of all its points
    schedule: str = "robust"

    def study_of(self, extent: Extent) -> Study:
        """Return the study that makes it."""
        settings: dict[str, Any] = {"schedule": self.schedule}
        return make_study(
            self.study,
            realizations=self.quick if extent == "quick" else self.full,
            methods=self.methods,
            selection=self.points,
            settings=TrialSettings(**settings),
        )

    def duration_s(self, extent: Extent, workers: int = 1) -> float:
        """Return how long it takes, about."""
        return self.seconds * (self.quick if extent == "quick" else self.full) / workers


_OF_FIGURE_3 = ("object-only", "factorised", "joint", NO_INTERFERENCE)


def _example(number: str, title: str, realizations: int = 1, seconds: float = 1.0) -> Figure:
    return Figure(
        name=number,
        source=VSEP,
        title=title,
        study=f"fig-{number}",
        quick=realizations,
        full=realizations,
        seconds=seconds,
    )


FIGURES: Final[dict[str, Figure]] = {
    figure.name: figure
    for figure in (
        _example("1", "Time-frequency plots of objects and interference"),
        _example("2", "Example signals of Simulation I"),
        *(
            Figure(
                name=panel,
                source=VSEP,
                title=title,
                study="fig-3",
                points=panel,
                methods=_OF_FIGURE_3,
                quick=quick,
                full=500,
                seconds=seconds,
            )
            for panel, title, quick, seconds in (
                ("3a", "RMSE over SNR at SIR 0 dB", 60, 0.45),
                ("3b", "RMSE over SIR at SNR 30 dB", 60, 0.45),
                ("3c", "RMSE over SIR with a model error of the filter", 20, 1.8),
            )
        ),
        Figure(
            name="3b-letter",
            source=VSEP,
            title="RMSE over SIR by the letter of Algorithms 1 to 4",
            study="fig-3",
            points="3b",
            methods=("factorised", NO_INTERFERENCE),
            quick=20,
            full=500,
            seconds=1.3,
            schedule="paper",
        ),
        _example("4", "Example signals with a model error of the filter"),
        *(
            Figure(
                name=panel,
                source=VSEP,
                title=title,
                study="fig-5",
                points=panel,
                quick=6,
                full=200,
                seconds=seconds,
            )
            for panel, title, seconds in (
                ("5a-c", "Ten objects over SNR at SIR -20 dB", 5.0),
                ("5d-f", "Ten objects over SIR at SNR 60 dB; 5g-i are boxes of it", 7.0),
            )
        ),
        _example("6", "Example signals of Simulation II"),
        _example("7", "Recorded frame with bursts, and one ramp of it (7 and 8)", 6, 2.0),
        *(
            Figure(
                name=f"mru-{what}",
                source=MRU,
                title=title,
                study=f"mru-{what}",
                quick=quick,
                full=20,
                seconds=seconds,
            )
            for what, title, quick, seconds in (
                # A table of `assets/docs/mitigation.md` each, too.
                ("share", "Compressive sensing over the share lost, and over levels", 2, 36.0),
                ("prior", "The prior: number and source of its frames, a wrong one", 3, 9.0),
                ("solver", "Thresholds, step width, samples drawn", 4, 5.0),
                ("size", "Time and memory of masked updates and the explicit matrix", 3, 2.0),
            )
        ),
        *(
            Figure(
                name=what,
                source=OWN,
                title=title,
                study=what,
                quick=6,
                full=30,
                seconds=seconds,
            )
            for what, title, seconds in (
                ("repairs", "Repairs of bursts as simulated, cut and moved", 3.0),
                ("detectors", "Detectors of interfered samples", 2.5),
            )
        ),
    )
}
"""All of them by name, in the order of the papers."""


def chosen_figures(names: Iterable[str]) -> tuple[Figure, ...]:
    """Return figures by their names; all if none is named.

    Raises `InputError` if one is unknown.

    Examples
    --------
    >>> [figure.study for figure in chosen_figures(["3b", "7"])]
    ['fig-3', 'fig-7']
    """
    wanted = list(names)
    for name in wanted:
        if name not in FIGURES:
            raise InputError(f"figure is {shown(name)}; it must be one of {', '.join(FIGURES)}.")
    return tuple(figure for name, figure in FIGURES.items() if name in wanted or not wanted)
