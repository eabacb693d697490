"""Fig. 4: example signals of Simulation I with a mismatched filter."""

from vsep.studies.catalogue._points import example_signals, one_object

STUDY = example_signals(
    "fig-4",
    "Simulation I with a mismatched filter at SIR -15 dB",
    *(
        one_object("4", butterworth_order=order, interference_model="convolution", sir_db=-15.0)
        for order in (4, 8)
    ),
)
