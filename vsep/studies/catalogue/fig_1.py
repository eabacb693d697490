"""Fig. 1c to 1e: objects and interference in the time-frequency plane, and their levels."""

from dataclasses import replace

from vsep.studies.catalogue._points import example_signals, many_objects
from vsep.studies.study import Study

_SIGNALS = example_signals(
    "fig-1", "the signal model, in time and frequency", many_objects("1", sir_db=-15.0)
)
STUDY: Study = replace(_SIGNALS, methods=("object-only",), example="time-frequency")
