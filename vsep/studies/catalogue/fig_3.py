"""Fig. 3: error of a single object against the Cramer-Rao bound."""

from collections.abc import Iterator
from typing import Any, TypeAlias

from vsep.studies.catalogue._points import levels, one_object
from vsep.studies.methods import estimator_names
from vsep.studies.panel_specs import PanelSpec, QuantileSpec
from vsep.studies.study import Study

_EXPECTED_RATIO = 1.08
_FIGURES: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
    ("3a", "snr_db", "over SNR at SIR 0 dB", {}),
    ("3b", "sir_db", "over SIR at SNR 30 dB", {}),
    ("3c", "sir_db", "Butterworth bursts, raised cosine assumed", {"variant": "butterworth_order"}),
)
_Metrics: TypeAlias = tuple[tuple[str, str, dict[str, Any]], ...]
_RMSE: dict[str, Any] = {"log_y": True, "with_bound": True}
_RATIO: dict[str, Any] = {"log_y": True, "guides": ((f"{_EXPECTED_RATIO}", _EXPECTED_RATIO),)}
_STATISTICS: dict[str, _Metrics] = {
    "exactly one object, the paper's statistic": (
        ("rmse_exact", "RMSE [cycles/sample]", _RMSE),
        ("rmse_exact_over_crlb", "RMSE / root CRLB", _RATIO),
        ("exact_order_rate", "share of frames with exactly one object", {}),
    ),
    "an object within half a cell": (
        ("rmse_detected", "RMSE [cycles/sample]", _RMSE),
        ("rmse_detected_over_crlb", "RMSE / root CRLB", _RATIO),
        ("detection_rate", "detected within half a cell", {}),
        ("false_alarms", "false alarms a frame", {}),
    ),
}


def _panels() -> Iterator[PanelSpec]:
    for panel, x, about, variant in _FIGURES:
        for statistic, metrics in _STATISTICS.items():
            title = f"Fig. {panel}: {about}; {statistic}"
            for metric, label, looks in metrics:
                yield PanelSpec(
                    panel=panel, metric=metric, x=x, y_label=label, title=title, **variant, **looks
                )


STUDY = Study(
    name="fig-3",
    title="Simulation I: RMSE against the Cramer-Rao bound over SNR, SIR, filter mismatch",
    realizations=500,
    points=(
        *[one_object("3a", snr_db=snr_db) for snr_db in levels(0, 60)],
        *[one_object("3b", sir_db=sir_db) for sir_db in levels(-50, 10)],
        *[
            one_object(
                "3c", sir_db=sir_db, butterworth_order=order, interference_model="convolution"
            )
            for order in (4, 8)
            for sir_db in levels(-50, 10)
        ],
    ),
    methods=estimator_names(),
    panels=(
        *_panels(),
        QuantileSpec(panel="3b", title="Fig. 3b: errors over their reported standard deviation"),
    ),
)
