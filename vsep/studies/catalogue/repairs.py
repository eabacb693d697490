"""Every repair given the perfect mask: bursts as simulated or cut to the pass band, and moved."""

from vsep.mitigation.registry import MITIGATIONS
from vsep.studies.catalogue._points import many_objects
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Study

ROLLED = 4  # ramps: at offset 0 the first interfered ramp hides under the edge of a window

STUDY = Study(
    name="repairs",
    title="Repairs of Simulation II at SIR -20 dB: bursts as simulated, cut, and moved",
    realizations=30,
    points=tuple(
        many_objects(
            "cut" if cut else "as simulated", sir_db=-20.0, cut_bursts=cut, rolled_ramps=rolled
        )
        for cut in (True, False)
        for rolled in (0, ROLLED)
    ),
    methods=("masked", *MITIGATIONS, NO_INTERFERENCE),
    panels=tuple(
        PanelSpec(
            panel=panel,
            metric=metric,
            x="rolled_ramps",
            y_label=label,
            title=f"Simulation II, SNR 60 dB, SIR -20 dB, bursts {panel}",
        )
        for panel in ("cut", "as simulated")
        for metric, label in (
            ("windowed_error_db", "windowed error [dB]"),
            ("misses", "misses a frame"),
            ("false_alarms", "false alarms a frame"),
        )
    ),
)
