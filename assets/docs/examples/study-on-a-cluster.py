"""Run a study on a cluster.

The same trials on the workers of a Dask scheduler: `pip install 'vsep[cluster]'` on every machine,
`dask scheduler` on one and `dask worker tcp://HOST:8786 --nthreads 1` on the others. On the command
line it is `vsep study run NAME --scheduler tcp://HOST:8786`. Here a scheduler and a worker run in
this process, and the rows are those of local processes.
"""

from distributed import LocalCluster

from vsep.studies.catalogue import make_study
from vsep.studies.engine import record_study

STUDY = make_study("fig-3", realizations=2, methods=("factorised",), selection="30")

with LocalCluster(
    n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
) as cluster:
    there = [
        row
        for rows in record_study(STUDY, "there.jsonl", scheduler=cluster.scheduler_address)
        for row in rows
    ]

print(f"{len(there)} rows by vsep {there[0]['version']}: {there[0]['num_objects']} object")
assert {row["status"] for row in there} == {"done"}
assert sorted(row["realization"] for row in there) == [0, 1]
