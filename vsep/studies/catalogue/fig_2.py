"""Fig. 2: example signals of Simulation I."""

from vsep.studies.catalogue._points import example_signals, one_object

STUDY = example_signals(
    "fig-2", "Simulation I at SNR 30 dB and SIR -15 dB", one_object("2", sir_db=-15.0)
)
