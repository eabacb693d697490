"""Condition (27) in both readings against the cost of interference."""

from typing import Any

from vsep.studies.catalogue._points import VICTIM_SLOPE_HZ_PER_S, levels, many_objects, one_object
from vsep.studies.methods import estimator_names
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Study

# Slope differences from twice that of Table I down to a burst longer than the ramp.
_DIFFERENCES_HZ_PER_S = (-1.6e12, -0.8e12, -0.2e12, -0.05e12)
_ONE: dict[str, Any] = {
    "panel": "simulation-1",
    "x": "sir_db",
    "variant": "interferer_slope_hz_per_s",
    "title": "Simulation I, SNR 30 dB",
}
_MANY: dict[str, Any] = {
    "panel": "simulation-2",
    "x": "sir_db",
    "title": "Simulation II, SNR 60 dB",
}
_CONDITION: dict[str, Any] = {"guides": (("equality", 0.0),), "of_scene": True}

STUDY = Study(
    name="separability",
    title="Condition (27) in both readings against the cost of interference",
    realizations=100,
    points=(
        *[
            one_object(
                _ONE["panel"],
                sir_db=sir_db,
                interferer_slope_hz_per_s=VICTIM_SLOPE_HZ_PER_S + difference,
            )
            for difference in _DIFFERENCES_HZ_PER_S
            for sir_db in levels(-40, 10)
        ],
        *[many_objects(_MANY["panel"], sir_db=sir_db) for sir_db in levels(-40, 40, 10)],
    ),
    methods=estimator_names(),
    panels=(
        PanelSpec(metric="separability_db", y_label="condition (27) [dB]", **_CONDITION, **_ONE),
        PanelSpec(
            metric="paired_rmse_over_crlb",
            y_label="RMS change by interference / root CRLB",
            log_y=True,
            **_ONE,
        ),
        PanelSpec(
            metric="separability_db",
            y_label="condition (27), all objects [dB]",
            **_CONDITION,
            **_MANY,
        ),
        PanelSpec(
            metric="separability_weakest_db",
            y_label="condition (27), weakest object [dB]",
            **_CONDITION,
            **_MANY,
        ),
        PanelSpec(metric="excess_misses", y_label="misses by interference, a frame", **_MANY),
        PanelSpec(
            metric="excess_false_alarms", y_label="false alarms by interference, a frame", **_MANY
        ),
    ),
)
