"""Run a study on several processes.

A study is a set of points with a number of realisations each. A trial is a pure function of study
seed, point and realisation: the number of processes and an interruption change nothing but the
order of the rows. The file is appended to; the same call again goes on where it was.
"""

from vsep.studies.catalogue import make_study
from vsep.studies.engine import record_study
from vsep.studies.rows import read_rows
from vsep.studies.summary import summarise

# The guard is needed wherever processes are started: they load this file again.
if __name__ == "__main__":
    study = make_study(
        "fig-3", realizations=2, methods=("factorised", "no-interference"), selection="15,30"
    )
    for rows in record_study(study, "fig-3.jsonl", workers=2):
        print("finished:", [f"{row['method']} {row['realization']}" for row in rows])
    rows = read_rows("fig-3.jsonl")
    assert len(rows) == study.num_rows == 8
    # Nothing is missing, so that the same call again has nothing to do.
    assert list(record_study(study, "fig-3.jsonl", workers=2)) == []

    for measure in summarise(rows, metrics=["detection_rate"]):
        interval = measure.interval
        print(
            f"SIR {measure.point['sir_db']:+.0f} dB, {measure.method:<16}found "
            f"{interval.value:.2f} [{interval.low:.2f}, {interval.high:.2f}]"
        )
        assert 0.0 <= interval.low <= interval.value <= interval.high <= 1.0
