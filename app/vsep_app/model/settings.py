"""What a user can set: bounds, units and plain words of every control, declared once.

`Settings` is the one mutable record of a session. A `Plan` is its frozen copy that workers get: all
that determines a run. View settings (selected ramp, speed, kind of fast-time plot) are not part of
a plan, so changing them never restarts a run.
"""

from dataclasses import dataclass
from typing import Any

import param

from vsep.signal.simulate import INTERFERENCE_MODELS, InterferenceModel

FILTER_KINDS = ("raised_cosine", "butterworth", "none", "measured")
REAL_FRAME = "real-frame"
LOADED_FRAME = "loaded-frame"
FALSE_ALARM_RATES = (0.001, 0.003, 0.01, 0.03, 0.05, 0.1, 0.3, 1.0, 3.0)


@dataclass(frozen=True, kw_only=True)
class PresetRanges:
    """Defaults and slider ranges of one preset.

    Parameters
    ----------
    label : str
        What the selector shows.
    snr_db, sir_db : float
        Defaults of the levels.
    victim_slope, slope : float
        Slopes of the victim and, by default, of the interferer in MHz/us.
    slope_range : (float, float)
        Range of the interferer slope in MHz/us.
    cutoff, cutoff_range : float, (float, float)
        Half-amplitude edge of the anti-aliasing filter in MHz.
    shift_range : float
        Largest shift of the burst within a ramp in us.
    """

    label: str
    snr_db: float = 30.0
    sir_db: float
    victim_slope: float
    slope: float
    slope_range: tuple[float, float]
    cutoff: float
    cutoff_range: tuple[float, float]
    shift_range: float


def _simulation_ii(label: str, slope: float) -> PresetRanges:
    return PresetRanges(
        label=f"Simulation II {label}",
        snr_db=60.0,
        sir_db=-20.0,
        victim_slope=10.0,
        slope=slope,
        slope_range=(8.0, 12.0),
        cutoff=1.275,
        cutoff_range=(0.4, 2.5),
        shift_range=12.0,
    )


PRESETS: dict[str, PresetRanges] = {
    "simulation-1": PresetRanges(
        label="Simulation I: one object, one ramp",
        sir_db=-20.0,
        victim_slope=10.0,
        slope=9.2,
        slope_range=(8.0, 12.0),
        cutoff=2.55,
        cutoff_range=(0.8, 5.0),
        shift_range=12.0,
    ),
    "simulation-2-a": _simulation_ii("a: 2 long bursts", 9.8321),
    "simulation-2-b": _simulation_ii("b: 4 bursts", 9.7122),
    "simulation-2-c": _simulation_ii("c: 8 short bursts", 9.3925),
    REAL_FRAME: PresetRanges(
        label="Real frame with simulated interference",
        sir_db=-10.0,
        victim_slope=60.0,
        slope=59.9,
        slope_range=(59.5, 60.5),
        cutoff=0.625,
        cutoff_range=(0.2, 1.25),
        shift_range=20.0,
    ),
}


class Settings(param.Parameterized):
    """All that the controls set, with bounds; a value outside of its bounds raises ValueError."""

    preset: Any = param.Selector(
        default="simulation-1",
        objects=[*PRESETS, LOADED_FRAME],
        doc="The scene: the simulations of Table I, or a recorded frame with simulated bursts.",
    )
    snr_db = param.Number(
        default=30.0,
        bounds=(-10.0, 90.0),
        label="SNR [dB, total]",
        doc="Energy of all objects of the frame over the noise power of one sample, in dB: "
        "10 log₁₀(‖Φα‖² λ), (25). More: less noise.",
    )
    sir_db = param.Number(
        default=-20.0,
        bounds=(-50.0, 40.0),
        label="SIR [dB, total]",
        doc="Energy of all objects over the energy of all bursts of the frame, in dB: "
        "10 log₁₀(‖Φα‖² / ‖UΨβ‖²), (26). Less: stronger bursts.",
    )
    interference = param.Boolean(
        default=True, label="Interference", doc="Off: the same objects and noise without bursts."
    )
    interferer_slope = param.Number(
        default=9.2,
        bounds=(0.1, 200.0),
        label="Interferer slope [MHz/µs]",
        doc="Sweep rate kᵢ of the other radar in MHz/µs. A burst lasts band / |kᵢ - k|: the closer "
        "to the victim's slope k, the longer.",
    )
    burst_shift = param.Number(
        default=0.0,
        bounds=(-60.0, 60.0),
        label="Burst position [µs]",
        doc="Moves the crossing inside the ramp by that many µs, by delaying the other radar; 0 is "
        "the preset's.",
    )
    interference_model: Any = param.Selector(
        default="multiplicative",
        objects=list(INTERFERENCE_MODELS),
        label="Interference model",
        doc="How bursts are made: the paper's product form, the exact convolution, or the exact "
        "convolution with the ramp edges of the other radar.",
    )
    seed = param.Integer(
        default=7,
        bounds=(0, 999_999),
        label="Seed",
        doc="Draws objects, phases and noise; the same seed gives the same frame.",
    )
    filter_kind: Any = param.Selector(
        default="raised_cosine",
        objects=list(FILTER_KINDS[:3]),
        label="True filter",
        doc="Anti-aliasing filter that shapes the bursts.",
    )
    filter_cutoff = param.Number(
        default=2.55,
        bounds=(1e-5, 1e5),
        label="Cutoff [MHz]",
        doc="Frequency in MHz at which the filter passes half the amplitude: |G| = 1/2, -6 dB.",
    )
    filter_rolloff = param.Number(
        default=0.25,
        bounds=(0.05, 1.0),
        label="Roll-off",
        doc="The raised cosine falls from 1 to 0 between (1 - roll-off) and (1 + roll-off) times "
        "the cutoff; no unit.",
    )
    filter_order = param.Integer(
        default=8,
        bounds=(1, 12),
        label="Order",
        doc="Order n of the Butterworth filter: |G|² = 1 / (1 + 3 (f/cutoff)²ⁿ). More: a steeper "
        "edge.",
    )
    assume_true_filter = param.Boolean(
        default=True,
        label="Estimator knows it",
        doc="Off: set the filter that the estimator assumes apart from the true one.",
    )
    assumed_kind: Any = param.Selector(
        default="raised_cosine",
        objects=list(FILTER_KINDS),
        label="Assumed filter",
        doc="Filter the estimator believes in. Measured: only if the loaded frame brings one.",
    )
    assumed_cutoff = param.Number(
        default=2.55,
        bounds=(1e-5, 1e5),
        label="Assumed cutoff [MHz]",
        doc="Half-amplitude frequency in MHz that the estimator assumes: |G| = 1/2.",
    )
    assumed_rolloff = param.Number(
        default=0.25,
        bounds=(0.05, 1.0),
        label="Assumed roll-off",
        doc="Roll-off of the raised cosine that the estimator assumes; no unit.",
    )
    assumed_order = param.Integer(
        default=8,
        bounds=(1, 12),
        label="Assumed order",
        doc="Order n that the estimator assumes: |G|² = 1 / (1 + 3 (f/cutoff)²ⁿ).",
    )
    estimator: Any = param.Selector(
        default="factorised",
        objects=["factorised", "joint", "object-only"],
        label="Estimator",
        doc="Factorised: separates objects and bursts. Joint: the same, one covariance, slower. "
        "Object-only: knows nothing of bursts.",
    )
    schedule: Any = param.Selector(
        default="robust",
        objects=["robust", "paper"],
        label="Schedule",
        doc="Robust: searches bursts anew in early iterations. Paper: literal order of steps.",
    )
    false_alarm_rate = param.Number(
        default=0.05,
        bounds=(1e-6, 100.0),
        label="False alarms a frame",
        doc="Accepted number of ghosts in a frame of noise alone; sets the threshold T: "
        "N √(πT/3) exp(-T) for one ramp, NP (πT/3) exp(-T) for several.",
    )
    object_threshold_db = param.Number(
        default=None,
        allow_None=True,
        bounds=(0.0, 100.0),
        label="Object threshold [dB]",
        doc="T in dB: an object counts where its power over its own variance, ω²/ρ, exceeds it. "
        "Empty: follows from the false alarms a frame.",
    )
    max_iterations = param.Integer(
        default=100,
        bounds=(1, 500),
        label="Largest number of iterations",
        doc="The run stops here if it has not converged.",
    )
    ramp = param.Integer(
        default=0, bounds=(0, 65_535), label="Ramp", doc="Ramp shown in fast time and delay."
    )
    speed = param.Integer(
        default=12,
        bounds=(1, 30),
        label="Speed [iterations/s]",
        doc="How fast iterations are shown; slow machines may fall behind.",
    )
    antenna = param.Integer(
        default=0,
        bounds=(0, 1023),
        label="Antenna",
        doc="Antenna shown, from 0. Factorised and object-only take all of them apart together; "
        "joint takes the one shown, alone.",
    )
    fast_time: Any = param.Selector(
        default="level",
        objects=["level", "real"],
        label="Fast time",
        doc="Level in dB, or the real part of the signals.",
    )

    def choose_preset(self, preset: str) -> None:
        """Take a preset together with its levels, slope and filter edges."""
        self.param.update(**preset_values(preset))

    def plan(self) -> "Plan":
        """Return the frozen copy of all that determines a run."""
        return Plan(**{name: getattr(self, name) for name in Plan.__dataclass_fields__})


@dataclass(frozen=True, kw_only=True)
class Plan:
    """All that determines a run, as `Settings` of the same names; frozen and picklable."""

    preset: str
    snr_db: float
    sir_db: float
    interference: bool
    interferer_slope: float
    burst_shift: float
    interference_model: InterferenceModel
    seed: int
    filter_kind: str
    filter_cutoff: float
    filter_rolloff: float
    filter_order: int
    assume_true_filter: bool
    assumed_kind: str
    assumed_cutoff: float
    assumed_rolloff: float
    assumed_order: int
    estimator: str
    schedule: str
    false_alarm_rate: float
    object_threshold_db: float | None
    max_iterations: int


PLAN_NAMES = tuple(Plan.__dataclass_fields__)
VIEW_NAMES = ("ramp", "antenna", "speed", "fast_time")


def preset_values(preset: str) -> dict[str, Any]:
    """Return the values that choosing a preset sets; a loaded frame sets only itself."""
    ranges = PRESETS.get(preset)
    if ranges is None:
        return {"preset": preset, "ramp": 0}
    return {
        "preset": preset,
        "snr_db": ranges.snr_db,
        "sir_db": ranges.sir_db,
        "interferer_slope": ranges.slope,
        "burst_shift": 0.0,
        "filter_cutoff": ranges.cutoff,
        "assumed_cutoff": ranges.cutoff,
        "ramp": 0,
    }
