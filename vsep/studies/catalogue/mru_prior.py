"""The prior of earlier frames: how many, of which source, and a wrong one."""

from vsep.studies.catalogue._gaps import gap_panels, gaps
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import Study

_FRAMES = (1, 2, 3, 5, 8)

STUDY = Study(
    name="mru-prior",
    title="A prior of earlier frames: their number, their source, and a wrong one",
    realizations=20,
    points=(
        *[gaps("frames", num_prior_frames=count) for count in _FRAMES],
        *[gaps("source", prior_source="original", num_prior_frames=count) for count in _FRAMES],
        *[gaps("wrong", prior="other", num_prior_frames=count) for count in _FRAMES],
        *[gaps("debiased", num_prior_frames=count, debias=True) for count in _FRAMES],
        *[
            gaps("prior-share", share_lost=share, prior=prior)
            for prior in ("own", "other")
            for share in (0.1, 0.3, 0.5, 0.7)
        ],
    ),
    methods=("ist", "pm-ist", "iht", "pm-iht", NO_INTERFERENCE),
    panels=(
        *gap_panels("frames", "num_prior_frames", "Frames recovered before"),
        *gap_panels("source", "num_prior_frames", "Frames as received before"),
        *gap_panels("debiased", "num_prior_frames", "A least-squares fit of the cells found"),
        *gap_panels("wrong", "num_prior_frames", "Frames of other objects before"),
        *gap_panels(
            "prior-share", "share_lost", "Own and wrong prior over the share", variant="prior"
        ),
    ),
)
