"""Detectors of interfered samples: what they miss and flag falsely, and what repairs make of it."""

from vsep.mitigation.masks.detectors import DETECTORS
from vsep.studies.catalogue._points import many_objects
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Study

STUDY = Study(
    name="detectors",
    title="Detectors of interfered samples over the level of the bursts",
    realizations=30,
    points=tuple(
        many_objects("cut" if cut else "as simulated", sir_db=sir_db, cut_bursts=cut, mask=mask)
        for cut in (True, False)
        for mask in ("truth", *DETECTORS)
        for sir_db in (-20.0, 0.0, 10.0)
    ),
    methods=("mca-2d", "masked"),
    panels=tuple(
        PanelSpec(
            panel=panel,
            metric=metric,
            x="sir_db",
            y_label=label,
            title=f"Simulation II, SNR 60 dB, bursts {panel}",
            variant="mask",
        )
        for panel in ("cut", "as simulated")
        for metric, label in (
            ("mask_missed", "share of interfered samples missed"),
            ("mask_false", "share of clean samples flagged"),
            ("windowed_error_db", "windowed error [dB]"),
        )
    ),
)
