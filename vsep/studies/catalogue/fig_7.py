"""Fig. 7 and 8: maps and one ramp of a recorded frame with bursts, and what is found in them."""

from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import Point, Study

STUDY = Study(
    name="fig-7",
    title="A recorded frame with bursts through a receiver that is not known",
    realizations=1,
    points=tuple(
        Point(panel="7", scene="semi-real", snr_db=40.0, sir_db=sir_db) for sir_db in (-20.0, -10.0)
    ),
    methods=("factorised", "masked", "object-only", "zeroing", NO_INTERFERENCE),
    example="maps",
)
