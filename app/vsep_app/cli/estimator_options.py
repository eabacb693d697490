"""Options of the commands that run an estimator: its choice and its settings."""

from typing import Any, Final

from vsep.files.frame_mask import MASK_NAMES
from vsep.inference.core.schedule import SCHEDULES
from vsep.inference.registry import ESTIMATORS
from vsep.parameters import PARAMETERS
from vsep.studies.methods import method_names
from vsep.studies.study import TrialSettings
from vsep_app.cli.shared_options import add_number, defaults_of, listed

DEFAULT_ESTIMATOR: Final = next(iter(ESTIMATORS))
ESTIMATOR_SETTINGS: Final = (
    "mask",
    "schedule",
    "false_alarm_rate",
    "object_threshold_db",
    "interference_threshold_db",
    "max_iterations",
    "range_migration",
    "acceleration",
)
"""Options that are settings of an estimator; None where they are not given."""


def estimator_settings() -> dict[str, frozenset[str]]:
    """Return the names of the settings of every estimator."""
    return {
        name: frozenset(entry.settings)
        | ({"acceleration"} if "range_migration" in entry.settings else set())
        for name, entry in ESTIMATORS.items()
    }


def add_mask_option(parser: Any, takers: str = "") -> None:
    """Add ``--mask``, which says how interfered samples are found."""
    parser.add_argument(
        "--mask",
        choices=MASK_NAMES,
        help="interfered samples: from the frame file (truth), or as this detector finds them "
        f"(default: truth if the file has it, else autoregressive{takers})",
    )


def add_schedule_option(parser: Any) -> None:
    """Add ``--schedule``, the order of updates."""
    parser.add_argument(
        "--schedule",
        choices=tuple(SCHEDULES),
        help="order of the updates; paper is the literal one of the paper, for comparison "
        f"(default: {_default('schedule')}{_takers('schedule')})",
    )


def add_false_alarm_option(parser: Any) -> None:
    """Add ``--false-alarm-rate``."""
    add_number(
        parser,
        "--false-alarm-rate",
        f"objects expected in a frame of noise alone (default: {_default('false_alarm_rate')})",
    )


def add_same_slope_option(parser: Any) -> None:
    """Add ``--same-slope``, which says what becomes of ramps with such an interferer."""
    record = PARAMETERS["same_slope"]
    parser.add_argument(
        "--same-slope",
        choices=tuple(record.choices or ()),
        default=record.default,
        help="ramps with a strong tone that others lack, as an interferer of the same slope makes: "
        f"used like all others, or taken as missing (default: {record.default})",
    )


def add_estimator_options(parser: Any) -> None:
    """Add the choice of the estimator and all its settings; None where they are not given."""
    group = parser.add_argument_group("the estimator")
    group.add_argument(
        "--estimator",
        metavar="NAME",
        help="; ".join(f"{name}: {entry.help}" for name, entry in ESTIMATORS.items()).replace(
            "%", "%%"
        )
        + f" (default: {DEFAULT_ESTIMATOR})",
    )
    add_mask_option(group, _takers("mask"))
    add_schedule_option(group)
    threshold = group.add_mutually_exclusive_group()
    add_false_alarm_option(threshold)
    add_number(threshold, "--object-threshold-db", "the object threshold itself")
    add_number(
        group,
        "--interference-threshold-db",
        "threshold of interference-channel components "
        f"(default: that of the schedule{_takers('interference_threshold_db')})",
    )
    add_number(
        group,
        "--max-iterations",
        f"where a run stops at the latest (default: {_default('max_iterations')})",
        kind=int,
    )
    group.add_argument(
        "--range-migration",
        choices=tuple(PARAMETERS["range_migration"].choices or ()),
        help="whether objects that move through range cells are modelled, where the frame file "
        f"says so (default: {_default('range_migration')}{_takers('range_migration')})",
    )

    group.add_argument(
        "--acceleration",
        choices=tuple(PARAMETERS["acceleration"].choices or ()),
        help="whether objects whose velocity changes within the frame are modelled (default: "
        f"{PARAMETERS['acceleration'].default}{_takers('acceleration')})",
    )


def add_seed_option(parser: Any, what: str) -> None:
    """Add ``--seed``, as studies and maps take it."""
    default = defaults_of(TrialSettings)["seed"]
    add_number(parser, "--seed", f"{what} (default: {default})", kind=int)


def add_workers_option(parser: Any) -> None:
    """Add ``--workers``, as studies and maps take it."""
    add_number(parser, "--workers", "local processes (default: 1)", kind=int)


def method_settings() -> dict[str, frozenset[str]]:
    """Return the names of the settings of every method of the studies."""
    return {name: estimator_settings().get(name, frozenset()) for name in method_names()}


def default_of(estimator: str, setting: str) -> Any:
    """Return the default of an estimator's setting; None where it has no such setting."""
    return ESTIMATORS.require(estimator).defaults.get(setting)


def _default(setting: str) -> Any:
    return default_of(DEFAULT_ESTIMATOR, setting)


def _takers(setting: str) -> str:
    """Return who takes a setting, for a help text."""
    names = [name for name, settings in estimator_settings().items() if setting in settings]
    return f"; for {listed(names)}"
