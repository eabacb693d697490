"""Figure 3b with other readings of the paper's algorithms than their letter.

As a script it writes the table of `assets/docs/results.md`, in a quarter of an hour on one core:

    python -m tests.vsep.readings_bench assets/results
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from vsep_app.cli import main as cli

from vsep import EstimatorEntry, FactorisedSeparator, make_study, record_study
from vsep.inference.core.schedule import PAPER

# Settings of the estimator, realisations, points: all of Figure 3b; SIR -50, -40, -30, -20 dB.
READINGS = {
    "theta-to-its-end": ({"schedule": replace(PAPER, refinement_steps=50)}, 500, "3b"),
    "weights-follow": ({"schedule": replace(PAPER, recompute_amplitudes=True)}, 120, "3b"),
    "letter-1000": ({"schedule": "paper", "max_iterations": 1000}, 60, "13,15,17,19"),
}


def study_of(name):
    """The study of one reading."""
    settings, realizations, points = READINGS[name]
    method = EstimatorEntry(name=name, factory=partial(FactorisedSeparator, **settings))
    return make_study("fig-3", realizations=realizations, methods=(method,), selection=points)


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        rows = str(Path(folder) / "readings.jsonl")
        for reading in READINGS:
            list(record_study(study_of(reading), rows))
        out = str(Path(sys.argv[1]) / "fig-3b-readings.csv")
        sys.exit(cli.main(["study", "summary", rows, "--out", out]))
