"""Fig. 6: example signals of Simulation II."""

from vsep.studies.catalogue._points import example_signals, many_objects

STUDY = example_signals(
    "fig-6", "Simulation II at SNR 60 dB and SIR -15 dB", many_objects("6", sir_db=-15.0)
)
