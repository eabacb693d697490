"""Which metric goes into which panel of a study's figure."""

from dataclasses import dataclass
from typing import Any

from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.entry import COMPRESSIVE_SENSING
from vsep.mitigation.registry import MITIGATIONS
from vsep.studies.methods import (
    ITERATIONS_AFTER_REPAIR,
    MASKED_BY_DETECTOR,
    NO_INTERFERENCE,
)

_EXPECTED_RATIO = 1.08


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """Which metric of which part of a study goes into a panel.

    A metric of the scene is the same for all methods and drawn once. Without a choice of methods
    all that have rows are drawn.
    """

    panel: str
    metric: str
    x: str
    y_label: str
    title: str
    variant: str | None = None
    methods: tuple[str, ...] | None = None
    of_scene: bool = False
    log_x: bool = False
    log_y: bool = False
    guides: tuple[tuple[str, float], ...] = ()
    with_bound: bool = False


def _figure_3_plans() -> list[Plan]:
    plans = []
    for panel, x, about in (
        ("3a", "snr_db", "over SNR at SIR 0 dB"),
        ("3b", "sir_db", "over SIR at SNR 30 dB"),
        ("3c", "sir_db", "Butterworth bursts, raised cosine assumed"),
    ):
        variant = {"variant": "butterworth_order"}
        common: dict[str, Any] = {"panel": panel, "x": x, **(variant if panel == "3c" else {})}
        title = f"Fig. {panel}: {about}"
        plans += [
            Plan(
                metric="rmse_detected",
                y_label="RMSE [cycles/sample]",
                title=title,
                log_y=True,
                with_bound=True,
                **common,
            ),
            Plan(
                metric="rmse_detected_over_crlb",
                y_label="RMSE / root CRLB",
                title=title,
                log_y=True,
                guides=((f"{_EXPECTED_RATIO}", _EXPECTED_RATIO),),
                **common,
            ),
            Plan(
                metric="detection_rate",
                y_label="detected within half a cell",
                title=title,
                **common,
            ),
            Plan(metric="false_alarms", y_label="false alarms a frame", title=title, **common),
        ]
    return plans


_FIGURE_5_PANELS = (
    ("5a-c", "snr_db", "over SNR at SIR -20 dB"),
    ("5d-f", "sir_db", "over SIR at SNR 60 dB"),
    ("5-edges", "sir_db", "exact convolution with the interferer's ramp edges"),
    ("5-two-bursts", "sir_db", "two bursts in every interfered ramp"),
    ("5-three-bursts", "sir_db", "three bursts of two interferers in every interfered ramp"),
)


_ERROR_MISSES_FALSE_ALARMS = (
    ("mean_assigned_error", "mean assigned error [cycles]"),
    ("misses", "misses a frame"),
    ("false_alarms", "false alarms a frame"),
)
_SPARSE = MITIGATIONS.in_group(COMPRESSIVE_SENSING)
_METHODS_FIGURES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Estimators on the frame as received", (*ESTIMATORS, *MASKED_BY_DETECTOR)),
    (
        f"Repair with the perfect mask, then at most {ITERATIONS_AFTER_REPAIR} iterations",
        ("factorised", *(name for name in MITIGATIONS if name not in _SPARSE)),
    ),
    (
        "Compressive sensing with the perfect mask, then at most "
        f"{ITERATIONS_AFTER_REPAIR} iterations",
        ("factorised", *_SPARSE),
    ),
)


def _figure_5_plans() -> list[Plan]:
    return [
        Plan(
            panel=panel,
            metric=metric,
            x=x,
            y_label=label,
            title=f"Fig. {panel}: {about}",
            log_y=metric == "mean_assigned_error",
        )
        for panel, x, about in _FIGURE_5_PANELS
        for metric, label in _ERROR_MISSES_FALSE_ALARMS
    ]


def _methods_plans() -> list[Plan]:
    return [
        Plan(
            panel="methods",
            metric=metric,
            x="sir_db",
            y_label=label,
            title=title,
            log_y=metric == "mean_assigned_error",
            methods=(*methods, NO_INTERFERENCE),
        )
        for title, methods in _METHODS_FIGURES
        for metric, label in _ERROR_MISSES_FALSE_ALARMS
    ]


def _opponents_plans() -> list[Plan]:
    return [
        Plan(
            panel=panel,
            metric=metric,
            x=x,
            y_label=label,
            title=title,
            log_x=x == "interferer_slope_hz_per_s",
            log_y=metric == "mean_assigned_error",
            guides=(("the masked estimator", 0.0),) if metric == "gospa_over_masked" else (),
        )
        for panel, x, title in (
            ("length", "interferer_slope_hz_per_s", "Length of the bursts, at SIR -20 dB"),
            ("level", "sir_db", "Level of the bursts"),
            ("share", "num_interfered_ramps", "Share of interfered ramps, at SIR -20 dB"),
        )
        for metric, label in (
            *_ERROR_MISSES_FALSE_ALARMS,
            ("gospa_over_masked", "GOSPA above the masked's [cells]"),
        )
    ]


def _separability_plans() -> list[Plan]:
    slope = {"variant": "interferer_slope_hz_per_s"}
    one: dict[str, Any] = {"panel": "simulation-1", "x": "sir_db", **slope}
    many: dict[str, Any] = {"panel": "simulation-2", "x": "sir_db"}
    equality = (("equality", 0.0),)
    first, second = "Simulation I, SNR 30 dB", "Simulation II, SNR 60 dB"
    return [
        Plan(
            metric="separability_db",
            y_label="condition (27) [dB]",
            title=first,
            guides=equality,
            of_scene=True,
            **one,
        ),
        Plan(
            metric="paired_rmse_over_crlb",
            y_label="RMS change by interference / root CRLB",
            title=first,
            log_y=True,
            **one,
        ),
        Plan(
            metric="separability_db",
            y_label="condition (27), all objects [dB]",
            title=second,
            guides=equality,
            of_scene=True,
            **many,
        ),
        Plan(
            metric="separability_weakest_db",
            y_label="condition (27), weakest object [dB]",
            title=second,
            guides=equality,
            of_scene=True,
            **many,
        ),
        Plan(
            metric="excess_misses",
            y_label="misses by interference, a frame",
            title=second,
            **many,
        ),
        Plan(
            metric="excess_false_alarms",
            y_label="false alarms by interference, a frame",
            title=second,
            **many,
        ),
    ]


def _false_alarm_plans() -> list[Plan]:
    return [
        Plan(
            panel=panel,
            metric="false_alarm_ratio",
            x="false_alarm_rate",
            y_label=f"false alarms found / asked for, {size}",
            title="Frames of noise alone",
            log_x=True,
            guides=(("-25 %", 0.75), ("+25 %", 1.25)),
        )
        for panel, size in (("noise-1", "1 x 256"), ("noise-2", "16 x 128"))
    ]


PLANS: dict[str, list[Plan]] = {
    "fig-3": _figure_3_plans(),
    "fig-5": _figure_5_plans(),
    "fig-5-methods": _methods_plans(),
    "baselines": _opponents_plans(),
    "separability": _separability_plans(),
    "false-alarms": _false_alarm_plans(),
}
