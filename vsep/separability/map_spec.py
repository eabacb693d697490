"""Specification of a separability map: two axes, all other values, method, number of trials.

All cells of a map have the same objects, paths and noise, drawn from its seed: what
differs between two cells is what the axes say. Their trials are those of a study of one point.
"""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from vsep._typing import FloatArray
from vsep._validation import require_choice, require_range
from vsep.errors import InputError
from vsep.presets.registry import DEFAULT_PRESET, PRESET_NAMES, simulated_preset
from vsep.separability.axes import Axis, require_allowed, require_known
from vsep.signal.filters import NoFilter
from vsep.signal.radar import ChirpSequence
from vsep.signal.template import SignalModel
from vsep.studies.methods import require_methods, trial_estimator
from vsep.studies.study import Point, Trial, TrialSettings

Cell: TypeAlias = tuple[int, int]
MAP_STUDY = "separability-map"
MAX_TRIALS = 1000


@dataclass(frozen=True, kw_only=True, slots=True)
class MapSpec:
    """Specification of a map; equal ones have equal maps.

    Raises `InputError` if a name is unknown or a value not allowed.

    Examples
    --------
    >>> from vsep.separability.axes import parse_axis
    >>> spec = MapSpec(x=parse_axis("sir_db=-40:40:33"), y=parse_axis("snr_db=0:60:31"))
    >>> spec.point((32, 0)).sir_db, spec.point((0, 30)).snr_db
    (40.0, 60.0)
    """

    #: of two different parameters
    x: Axis
    y: Axis
    scene: str = DEFAULT_PRESET  #: one of `PRESET_NAMES`: radar, objects and paths
    #: values of parameters that are on no axis; the scene's own by default
    fixed: tuple[tuple[str, float], ...] = ()
    #: name of `vsep.studies.methods`: the estimator or mitigation method
    method: str = "factorised"
    trials: int = 5  #: realisations a cell
    #: seed and schedule; GOSPA decides what is missed
    settings: TrialSettings = field(default_factory=TrialSettings)
    #: sets the object threshold; the estimator's own by default
    false_alarm_rate: float | None = None

    def __post_init__(self) -> None:
        """Check names and values; the fixed ones get an order."""
        require_choice("The scene", self.scene, PRESET_NAMES)
        if self.x.name == self.y.name:
            raise InputError(f"Both axes are {self.x.name}; they must differ.")
        for name, value in self.fixed:
            require_allowed(require_known(name), value)
            if name in (self.x.name, self.y.name):
                raise InputError(f"{name} is fixed at {value:g} and on an axis; give it once.")
        if len({name for name, _ in self.fixed}) != len(self.fixed):
            raise InputError("A parameter is fixed twice; give each once.")
        require_methods((self.method,))
        require_range("Number of trials", self.trials, 0, MAX_TRIALS)
        object.__setattr__(self, "fixed", tuple(sorted(self.fixed)))
        self._require_possible()

    @property
    def radar(self) -> ChirpSequence:
        """The victim."""
        return simulated_preset(self.scene).radar

    @property
    def shape(self) -> tuple[int, int]:
        """(ny, nx), the shape of a map."""
        return self.y.count, self.x.count

    def parameters(self, cell: Cell) -> dict[str, float]:
        """Values of all parameters that the axes or fixed values set, at cell (ix, iy)."""
        column, row = cell
        return {
            **dict(self.fixed),
            self.x.name: float(self.x.values[column]),
            self.y.name: float(self.y.values[row]),
        }

    def over_cells(self, name: str) -> FloatArray | None:
        """(ny, nx) values of a parameter; None where the scene's own are left as they are."""
        if name == self.x.name:
            return np.broadcast_to(self.x.values, self.shape)
        if name == self.y.name:
            return np.broadcast_to(self.y.values[:, None], self.shape)
        fixed = dict(self.fixed)
        return np.full(self.shape, fixed[name]) if name in fixed else None

    def point(self, cell: Cell) -> Point:
        """Return the scene of a cell as a point of a study."""
        return self.point_of(self.parameters(cell))

    def point_of(self, values: dict[str, float]) -> Point:
        """Return the scene of given values; parameters without one have the scene's own."""
        share, count = values.get("interfered_share"), values.get("num_objects")
        difference = values.get("slope_difference_hz_per_s")
        slope = None if difference is None else self.radar.slope_hz_per_s + difference
        return Point(
            panel=MAP_STUDY,
            scene=self.scene,
            snr_db=values.get("snr_db", default_value(self.scene, "snr_db")),
            sir_db=values.get("sir_db", default_value(self.scene, "sir_db")),
            false_alarm_rate=self.false_alarm_rate,
            interferer_slope_hz_per_s=slope,
            num_interfered_ramps=None if share is None else ramps_of_share(self.radar, share),
            num_objects=None if count is None else int(count),
            object_delay_s=values.get("object_delay_s"),
            filter_cutoff_hz=values.get("filter_cutoff_hz"),
            filter_mismatch=values.get("filter_mismatch", 0.0),
        )

    def trial(self, cell: Cell, realization: int = 0) -> Trial:
        """Return one trial of a cell: a function of point, seed and realisation alone."""
        return Trial(
            study=MAP_STUDY,
            point_index=0,
            point=self.point(cell),
            realization=realization,
            methods=(self.method,),
            settings=self.settings,
        )

    def _require_possible(self) -> None:
        """Refuse at once what no cell could do."""
        radar = self.radar
        corners = [(column, row) for column in (0, self.x.count - 1) for row in (0, -1)]
        values = {name for cell in corners for name in self.parameters(cell)}
        if "interfered_share" in values and radar.num_ramps == 1:
            raise InputError(f"{self.scene} has one ramp; interfered_share needs several.")
        for cell in corners:
            own = self.parameters(cell)
            limit_s = 0.5 * radar.sample_rate_hz / radar.slope_hz_per_s
            require_range("object_delay_s", own.get("object_delay_s", 0.0), -limit_s, limit_s, "s")
            highest_hz = 0.5 * radar.sample_rate_hz
            cutoff_hz = own.get("filter_cutoff_hz", highest_hz)
            require_range("filter_cutoff_hz", cutoff_hz, 1e4, highest_hz, "Hz")
        model = SignalModel(
            num_ramps=1, num_samples=8, sample_rate_hz=1e6, anti_aliasing_filter=NoFilter()
        )
        trial_estimator(self.method, model, self.point((0, 0)), self.settings)


def ramps_of_share(radar: ChirpSequence, share: float) -> int:
    """Return how many ramps a share of them is, at least one."""
    return max(1, int(np.floor(share * radar.num_ramps + 0.5)))


def default_value(scene: str, name: str) -> float:
    """Return the value that a parameter has in a scene if nothing else is said; NaN if it is drawn.

    Examples
    --------
    >>> default_value("simulation-1", "snr_db"), default_value("simulation-2-a", "sir_db")
    (30.0, -20.0)
    """
    preset = simulated_preset(scene)
    radar, sequence = preset.radar, preset.interferer
    values = {
        "sir_db": preset.sir_db,
        "snr_db": preset.snr_db,
        "slope_difference_hz_per_s": sequence.slope_hz_per_s - radar.slope_hz_per_s,
        "object_delay_s": preset.object_delay_s,
        "num_objects": float(preset.num_objects),
        "interfered_share": sequence.num_ramps / radar.num_ramps,
        "filter_cutoff_hz": preset.filter_cutoff_hz,
        "filter_mismatch": 0.0,
    }
    return values[require_known(name)]
