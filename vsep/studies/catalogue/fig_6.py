"""Fig. 6: example signals of Simulation II."""

from vsep.studies.catalogue._points import many_objects
from vsep.studies.methods import estimator_names
from vsep.studies.study import Study

STUDY = Study(
    name="fig-6",
    title="Example signals of Simulation II at SNR 60 dB and SIR -15 dB",
    realizations=1,
    points=(many_objects("6", sir_db=-15.0),),
    methods=estimator_names(),
    example=True,
)
