"""Fig. 2: example signals of Simulation I."""

from vsep.studies.catalogue._points import one_object
from vsep.studies.methods import estimator_names
from vsep.studies.study import Study

STUDY = Study(
    name="fig-2",
    title="Example signals of Simulation I at SNR 30 dB and SIR -15 dB",
    realizations=1,
    points=(one_object("2", sir_db=-15.0),),
    methods=estimator_names(),
    example=True,
)
