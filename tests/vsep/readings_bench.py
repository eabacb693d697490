"""Figure 3b with other readings of the paper's algorithms than their letter.

As a script it writes the table of `assets/docs/results.md`, in five minutes on one core:

    python tests/vsep/readings_bench.py assets/results
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from vsep_app.cli import main as cli

from vsep import EstimatorEntry, FactorisedSeparator, make_study, record_study
from vsep.inference.core.schedule import PAPER

READINGS = {
    "theta-to-its-end": (replace(PAPER, refinement_steps=50), 500),
    "weights-follow": (replace(PAPER, recompute_amplitudes=True), 120),
}


def study_of(name):
    """The study of one reading."""
    schedule, realizations = READINGS[name]
    method = EstimatorEntry(name=name, factory=partial(FactorisedSeparator, schedule=schedule))
    return make_study("fig-3", realizations=realizations, methods=(method,), selection="3b")


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        rows = str(Path(folder) / "readings.jsonl")
        for reading in READINGS:
            list(record_study(study_of(reading), rows))
        out = str(Path(sys.argv[1]) / "fig-3b-readings.csv")
        sys.exit(cli.main(["study", "summary", rows, "--out", out]))
