"""Separation against the masked estimator over length, level and share of the bursts."""

from collections.abc import Iterator

from vsep.studies.catalogue._points import (
    VICTIM_SLOPE_HZ_PER_S,
    error_misses_false_alarms,
    levels,
    many_objects,
)
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Study

# Bursts of 0.17 to 4 ramps in the pass band: the slopes of Table I make 0.17, 0.35 and 0.61.
_DIFFERENCES_HZ_PER_S = (-0.6e12, -0.3e12, -0.15e12, -0.1e12, -0.05e12, -0.025e12)
_FIGURES = (
    ("length", "interferer_slope_hz_per_s", "Length of the bursts, at SIR -20 dB"),
    ("level", "sir_db", "Level of the bursts"),
    ("share", "num_interfered_ramps", "Share of interfered ramps, at SIR -20 dB"),
)


def _panels() -> Iterator[PanelSpec]:
    for panel, x, title in _FIGURES:
        log_x = x == "interferer_slope_hz_per_s"
        yield from error_misses_false_alarms(panel=panel, x=x, title=title, log_x=log_x)
        yield PanelSpec(
            panel=panel,
            metric="gospa_over_masked",
            x=x,
            y_label="GOSPA above the masked's [cells]",
            title=title,
            log_x=log_x,
            guides=(("the masked estimator", 0.0),),
        )


STUDY = Study(
    name="baselines",
    title="Separation against the masked estimator over the length, level, share of bursts",
    realizations=100,
    points=(
        *[
            many_objects("length", interferer_slope_hz_per_s=VICTIM_SLOPE_HZ_PER_S + difference)
            for difference in _DIFFERENCES_HZ_PER_S
        ],
        *[many_objects("level", sir_db=sir_db) for sir_db in levels(-40, 40, 10)],
        *[many_objects("share", num_interfered_ramps=count) for count in (2, 4, 8, 12, 16)],
    ),
    methods=("factorised", "masked", "masked-autoregressive", NO_INTERFERENCE),
    panels=tuple(_panels()),
)
