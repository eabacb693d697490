"""Settings of iterative thresholding: kind of threshold, its control, step width, samples drawn."""

from vsep.studies.catalogue._gaps import gap_panels, gaps
from vsep.studies.study import Study

_CONTROLS = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)

STUDY = Study(
    name="mru-solver",
    title="Iterative thresholding: kind of threshold, its control, step width, samples drawn",
    realizations=20,
    points=(
        *[
            gaps("control", threshold=threshold, control=control)
            for threshold in ("adaptive", "constant", "falling")
            for control in _CONTROLS
        ],
        *[gaps("step", step_width=width) for width in (0.2, 0.4, 0.6, 0.8, 1.0)],
        *[gaps("drawn", samples_per_ramp=count) for count in (8, 16, 32, 48, 64)],
    ),
    methods=("ist", "iht"),
    panels=(
        *gap_panels("control", "control", "Threshold control", variant="threshold"),
        *gap_panels("step", "step_width", "Step width"),
        *gap_panels("drawn", "samples_per_ramp", "Samples drawn from every ramp"),
    ),
)
