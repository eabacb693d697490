"""Fig. 5: error, misses and false alarms of scenes of ten objects.

The paper's five methods are no mitigation (object-only), zeroing, MCA, the proposed one
(factorised) and no interference. Beside them stand the strongest others, and MCA with a mask.
"""

from typing import Any

from vsep.studies.catalogue._points import error_misses_false_alarms, levels, many_objects
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panel_specs import BoxSpec, PanelSpec, QuantileSpec
from vsep.studies.study import Study

_EDGES = "convolution-with-edges"
_FIGURES = (
    ("5a-c", "snr_db", "over SNR at SIR -20 dB"),
    ("5d-f", "sir_db", "over SIR at SNR 60 dB"),
    ("5-edges", "sir_db", "exact convolution with the interferer's ramp edges"),
    ("5-two-bursts", "sir_db", "two bursts in every interfered ramp"),
    ("5-three-bursts", "sir_db", "three bursts of two interferers in every interfered ramp"),
)
_BOX_SNR_DB = 60.0
PAPER_METHODS = ("object-only", "zeroing", "mca-unmasked", "factorised", NO_INTERFERENCE)
_STRONGEST = ("masked", "masked-autoregressive", "mca", "autoregressive", "iht")
_CHOICES = (
    ("the paper's methods", PAPER_METHODS),
    ("the strongest others", ("factorised", *_STRONGEST, NO_INTERFERENCE)),
)


def _panels(**common: Any) -> list[PanelSpec]:
    """Return the paper's three panels, and the error against the bound.

    What the unknown interference costs is in the bound: that of no interference knows it.
    """
    return [
        *error_misses_false_alarms(**common),
        PanelSpec(
            metric="error_over_bound",
            y_label="error / its expectation at the bound",
            guides=(("the bound", 1.0),),
            log_y=True,
            **common,
        ),
    ]


STUDY = Study(
    name="fig-5",
    title="Simulation II: error, misses and false alarms over SNR and SIR",
    realizations=200,
    points=(
        *[many_objects("5a-c", snr_db=snr_db) for snr_db in levels(0, 70)],
        *[many_objects("5d-f", sir_db=sir_db) for sir_db in levels(-40, 40)],
        *[
            many_objects("5-edges", sir_db=sir_db, interference_model=_EDGES)
            for sir_db in levels(-40, 40, 10)
        ],
        *[
            many_objects("5-two-bursts", sir_db=sir_db, num_interferers=2)
            for sir_db in levels(-40, 40, 10)
        ],
        *[
            many_objects("5-three-bursts", sir_db=sir_db, num_interferers=2, num_second_crossings=2)
            for sir_db in levels(-40, 40, 20)
        ],
    ),
    methods=(*PAPER_METHODS[:-1], *_STRONGEST, NO_INTERFERENCE),
    panels=(
        *[
            spec
            for panel, x, about in _FIGURES
            for choice, methods in _CHOICES
            for spec in _panels(
                panel=panel, x=x, title=f"Fig. {panel}: {about}, {choice}", methods=methods
            )
        ],
        *[
            BoxSpec(
                panel="5d-f",
                title=f"Fig. 5g-i: SNR {_BOX_SNR_DB:g} dB, SIR {sir_db:g} dB, {choice}",
                snr_db=_BOX_SNR_DB,
                sir_db=sir_db,
                methods=methods,
            )
            for sir_db in (15.0, -15.0)
            for choice, methods in _CHOICES
        ],
        QuantileSpec(
            panel="5d-f", title="Fig. 5d-f: errors over their reported standard deviation"
        ),
    ),
)
