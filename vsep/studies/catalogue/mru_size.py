"""Two-dimensional masked updates against the explicit matrix: time and memory over the size."""

from vsep.studies.catalogue._gaps import gaps
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Study

_SIZES = (16, 32, 64)
_LARGE = (128, 256)

STUDY = Study(
    name="mru-size",
    title="Masked two-dimensional updates against the explicit matrix: time, memory",
    realizations=5,
    points=(
        *[
            gaps(
                "size",
                num_ramps=size,
                num_samples=size,
                share_lost=0.1,
                snr_db=20.0,
                num_prior_frames=0,
                domain="explicit-1d",
            )
            for size in _SIZES
        ],
        *[
            gaps(
                "size",
                num_ramps=size,
                num_samples=size,
                share_lost=0.1,
                snr_db=20.0,
                num_prior_frames=0,
            )
            for size in (*_SIZES, *_LARGE)
        ],
        # The source's frame: 10 % lost, q = 29491.
        gaps(
            "frame", num_ramps=256, num_samples=128, share_lost=0.1, snr_db=20.0, num_prior_frames=0
        ),
    ),
    methods=("ist", "iht"),
    panels=tuple(
        PanelSpec(
            panel=panel,
            metric=metric,
            x="num_ramps",
            y_label=label,
            title=title,
            variant="domain",
            log_x=panel == "size",
            log_y=panel == "size",
        )
        for panel, title in (
            ("size", "Square frames, a tenth of every ramp lost"),
            ("frame", "Frames of 256 x 128 samples, a tenth of every ramp lost"),
        )
        for metric, label in (
            ("iteration_ms", "time of an iteration [ms]"),
            ("operator_megabytes", "memory of the operator [MB]"),
        )
    ),
)
