"""The studies by name: one module each, and what other distributions bring.

A module of this package holds one `Study` named ``STUDY``. A distribution adds studies by entry
points of the group ``vsep.studies``. Chosen here where the paper is open or another choice shows
more:

- Thresholds: 9 dB in Simulation I, as the paper has it; 11 dB in Simulation II, where 9 dB means
  five false alarms in a frame of noise alone and hides everything else.
- The Butterworth filter of Fig. 3c has no stated order: 4 and 8, with the raised cosine's
  half-amplitude frequency.
- Fig. 5g-i is drawn from the points at SIR +15 and -15 dB of Fig. 5d-f: its caption says the one,
  its text the other.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, Final

from vsep._entry_points import load_entries, require_loadable
from vsep._validation import require_choice
from vsep.errors import InputError, shown
from vsep.presets.registry import NOISE_SCENES
from vsep.signal.filters import NoFilter
from vsep.signal.template import SignalModel
from vsep.studies.methods import NO_INTERFERENCE, Methods, read_methods, trial_estimator
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Point, Study, TrialSettings, select_points

GROUP: Final = "vsep.studies"


def _own_studies() -> Iterator[Study]:
    for module in iter_modules(__path__):
        if not module.name.startswith("_"):
            yield import_module(f"{__name__}.{module.name}").STUDY


# The figures of the paper first.
_OWN: Final[dict[str, Study]] = {
    study.name: study
    for study in sorted(_own_studies(), key=lambda one: (not one.name.startswith("fig-"), one.name))
}
CATALOGUE: Final[dict[str, Study]] = {
    **_OWN,
    **{
        study.name: study
        for study in load_entries(GROUP).values()
        if isinstance(study, Study) and study.name not in _OWN
    },
}


def require_study(name: str) -> Study:
    """Return a study of the catalogue by its name.

    Raises `InputError` if there is none of that name.
    """
    if name not in CATALOGUE:
        require_loadable(GROUP, name)
        raise InputError(f"study is {shown(name)}; it must be one of {', '.join(CATALOGUE)}.")
    return CATALOGUE[name]


def panel_specs(name: str) -> tuple[PanelSpec, ...]:
    """Return the panels with curves of a study, none if there is no such study."""
    return CATALOGUE[name].curves if name in CATALOGUE else ()


def make_study(
    study: str | Study,
    *,
    realizations: int | None = None,
    methods: tuple[Any, ...] | None = None,
    selection: str | None = None,
    settings: TrialSettings | None = None,
    object_threshold_db: float | None = None,
    changes: Mapping[str, Any] | None = None,
) -> Study:
    """Return a study with other realisations, methods, points or settings.

    Parameters
    ----------
    study : str or Study
        One of `CATALOGUE`, or one of your own.
    realizations : int, optional
        Per point; the study's by default.
    methods : tuple, optional
        Names, or objects that are not registered, see `vsep.studies.methods.read_methods`. By
        default the study's own. Noise alone is not run twice: without interference there is no
        reference.
    selection : str, optional
        Panels and indices of the points to run, see `select_points`.
    settings : TrialSettings, optional
        Seed, schedule and GOSPA.
    object_threshold_db : float, optional
        In the place of the points' own thresholds and rates.
    changes : mapping, optional
        Other values of parameters of all points, those of `vsep.studies.study.CHANGEABLE`.

    Raises
    ------
    InputError
        If a name is unknown or a number out of its range.

    Examples
    --------
    >>> study = make_study("fig-3", realizations=10, selection="3b")
    >>> len(study.points), study.point_indices[0], len(study.point_indices)
    (52, 13, 13)
    """
    own = require_study(study) if isinstance(study, str) else study
    changed = dict(changes or {})
    if object_threshold_db is not None:
        changed |= {"object_threshold_db": object_threshold_db, "false_alarm_rate": None}
    for name in changed:
        require_choice("A setting of the points", name, own.changeable)
    points = tuple(replace(point, **changed) for point in own.points)
    if methods is None:
        noise = all(point.scene in NOISE_SCENES for point in points)
        methods = tuple(name for name in own.methods if not (noise and name == NO_INTERFERENCE))
    settings = own.settings if settings is None else settings
    chosen = read_methods(methods)
    _require_usable(chosen, points, settings)
    return replace(
        own,
        points=points,
        realizations=own.realizations if realizations is None else realizations,
        methods=chosen.names,
        handed=chosen.handed,
        settings=settings,
        selected=own.selected if selection is None else select_points(points, selection),
    )


def _require_usable(methods: Methods, points: tuple[Point, ...], settings: TrialSettings) -> None:
    """Refuse a bad threshold at once, not once per trial: it is checked with any model."""
    model = SignalModel(
        num_ramps=1, num_samples=8, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
    )
    thresholds = {(point.object_threshold_db, point.false_alarm_rate): point for point in points}
    for method in methods.names:
        for point in thresholds.values():
            trial_estimator(method, model, point, settings, handed=methods.handed)
