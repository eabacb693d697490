"""Settings of the dashboard, made from the records of `vsep.parameters` and the presets.

`Settings` is the one mutable record of a session. A `Plan` is its frozen copy that workers get: all
that determines a run. View settings (selected ramp, speed, kind of fast-time plot) are not part of
a plan, so changing them never restarts a run.
"""

from dataclasses import Field, field, make_dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import param

from vsep.inference.registry import ESTIMATORS
from vsep.parameters import ESTIMATOR_PARAMETERS, FILTER_PARAMETERS, SCENE_PARAMETERS
from vsep.parameters.record import Parameter
from vsep.presets.places import parse_places
from vsep.presets.registry import DEFAULT_PRESET, PRESETS

LOADED_FRAME = "loaded-frame"
# A mask of interfered samples is what the compare page has a control for.
_SELF_SUFFICIENT = [entry for entry in ESTIMATORS.values() if not entry.needs_mask]
PRESET = Parameter(
    name="preset",
    title="Preset",
    help="The scene: the simulations of Table I, or a recorded frame with simulated bursts.",
    default=DEFAULT_PRESET,
    choices={name: preset.label for name, preset in PRESETS.items()}
    | {LOADED_FRAME: "Loaded frame"},
)
ESTIMATOR = Parameter(
    name="estimator",
    title="Estimator",
    help=" ".join(f"{entry.label}: {entry.help}" for entry in _SELF_SUFFICIENT),
    default=_SELF_SUFFICIENT[0].name,
    choices={entry.name: entry.label for entry in _SELF_SUFFICIENT},
)
PLACED = Parameter(
    name="placed",
    title="Object places",
    help="Range in m, velocity in m/s and level in dB of each object, as in 12,1.5,0; 20,0,-6, in "
    "the place of those that the seed draws. Empty: these.",
    default="",
    of_recording=False,
)
PLAN_PARAMETERS = (
    PRESET,
    *SCENE_PARAMETERS,
    PLACED,
    *FILTER_PARAMETERS,
    ESTIMATOR,
    *ESTIMATOR_PARAMETERS,
)
VIEW_PARAMETERS = (
    Parameter(
        name="ramp",
        title="Ramp",
        help="Ramp shown in fast time and delay.",
        default=0,
        bounds=(0, 65_535),
        typed=True,
    ),
    Parameter(
        name="crossing",
        title="Chirps",
        help="All ramps: the other radar's chirps over the whole frame. Spectrogram: of the ramp.",
        default="ramps",
        choices={"ramps": "All ramps", "spectrogram": "Spectrogram"},
    ),
    Parameter(
        name="antenna",
        title="Antenna",
        help="Antenna shown, from 0. Factorised and object-only take all of them apart together; "
        "joint takes the one shown, alone.",
        default=0,
        bounds=(0, 1023),
    ),
    Parameter(
        name="speed",
        title="Speed",
        unit="iterations/s",
        help="How fast iterations are shown; slow machines may fall behind.",
        default=12,
        bounds=(1, 30),
    ),
    Parameter(
        name="fast_time",
        title="Fast time",
        help="Level in dB, or the real part of the signals.",
        default="level",
        choices={"level": "Level", "real": "Real part"},
    ),
)
PLAN_NAMES = tuple(each.name for each in PLAN_PARAMETERS)
VIEW_NAMES = tuple(each.name for each in VIEW_PARAMETERS)
SETTINGS = {each.name: each for each in (*PLAN_PARAMETERS, *VIEW_PARAMETERS)}


class Places(param.String):  # type: ignore[type-arg]
    """A text of `vsep.presets.places`; any other is a ValueError."""

    def _validate(self, val: Any) -> None:
        super()._validate(val)
        parse_places(val)


def _declared(record: Parameter) -> Any:
    """Return the `param` declaration of a setting."""
    words: dict[str, Any] = {
        "default": record.default,
        "label": record.form_label,
        "doc": record.help,
    }
    if record.choices is not None:
        return param.Selector(objects=[*record.choices], **words)
    if isinstance(record.default, bool):
        return param.Boolean(**words)
    if isinstance(record.default, str):
        return Places(**words)
    kind: Any = param.Integer if record.whole else param.Number
    return kind(bounds=record.offered, allow_None=record.optional, **words)


class Settings(param.Parameterized):
    """All that the controls set, with bounds; a value outside of its bounds raises ValueError."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...

    def choose_preset(self, preset: str) -> None:
        """Take a preset together with its levels, slope and filter edges."""
        self.param.update(**preset_values(preset))

    def plan(self) -> "Plan":
        """Return the frozen copy of all that determines a run."""
        return Plan(**{name: getattr(self, name) for name in PLAN_NAMES})


for _record in SETTINGS.values():
    Settings.param.add_parameter(_record.name, _declared(_record))


if TYPE_CHECKING:

    class Plan:
        """All that determines a run, as `Settings` of the same names; frozen and picklable."""

        __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

        def __init__(self, **values: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...
else:
    Plan = make_dataclass(
        "Plan",
        [(name, Any, field()) for name in PLAN_NAMES],
        frozen=True,
        kw_only=True,
        namespace={
            "__doc__": "All that determines a run, as `Settings` of the same names; frozen.",
            "__module__": __name__,
        },
    )


def preset_values(preset: str) -> dict[str, Any]:
    """Return the values that choosing a preset sets; a loaded frame sets only itself.

    Examples
    --------
    >>> preset_values("simulation-2-b")["interferer_slope"]
    9.7122
    """
    known = PRESETS.get(preset)
    defaults = {} if known is None else known.defaults()
    return {"preset": preset, "placed": PLACED.default, **defaults, "ramp": 0}
