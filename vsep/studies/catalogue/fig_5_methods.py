"""Fig. 5d-f with every mitigation method, given the perfect mask."""

from vsep.mitigation.entry import COMPRESSIVE_SENSING
from vsep.mitigation.registry import MITIGATIONS
from vsep.studies.catalogue._points import error_misses_false_alarms, levels, many_objects
from vsep.studies.methods import (
    ITERATIONS_AFTER_REPAIR,
    MASKED_BY_DETECTOR,
    NO_INTERFERENCE,
    estimator_names,
)
from vsep.studies.study import Study

*_ESTIMATORS, _ = estimator_names()
_SPARSE = MITIGATIONS.in_group(COMPRESSIVE_SENSING)
_AFTERWARDS = f"with the perfect mask, then at most {ITERATIONS_AFTER_REPAIR} iterations"
_FIGURES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Estimators on the frame as received", (*_ESTIMATORS, *MASKED_BY_DETECTOR)),
    (
        f"Repair {_AFTERWARDS}",
        ("factorised", *(name for name in MITIGATIONS if name not in _SPARSE)),
    ),
    (f"Compressive sensing {_AFTERWARDS}", ("factorised", *_SPARSE)),
)

STUDY = Study(
    name="fig-5-methods",
    title="Simulation II over SIR with every mitigation method, given the perfect mask",
    realizations=100,
    # Half as dense as Fig. 5d-f: the estimator takes tens of objects to explain a badly repaired
    # frame, and seconds.
    points=tuple(many_objects("methods", sir_db=sir_db) for sir_db in levels(-40, 40, 10)),
    methods=(*_ESTIMATORS, *MASKED_BY_DETECTOR, *MITIGATIONS, NO_INTERFERENCE),
    panels=tuple(
        spec
        for title, methods in _FIGURES
        for spec in error_misses_false_alarms(
            panel="methods", x="sir_db", title=title, methods=(*methods, NO_INTERFERENCE)
        )
    ),
)
