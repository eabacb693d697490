"""Fig. 4: example signals of Simulation I with a mismatched filter."""

from vsep.studies.catalogue._points import one_object
from vsep.studies.methods import estimator_names
from vsep.studies.study import Study

STUDY = Study(
    name="fig-4",
    title="Example signals of Simulation I with a mismatched filter at SIR -15 dB",
    realizations=1,
    points=tuple(
        one_object("4", butterworth_order=order, interference_model="convolution", sir_db=-15.0)
        for order in (4, 8)
    ),
    methods=estimator_names(),
    example=True,
)
