"""Measure a method of your own on the frozen scenes.

A function of the received frame and the mask of its interfered samples is a method; so is a class
of [your own](your-own-mitigation.py). From the command line the same is
``vsep bench --method my_module:nearest_ramp --out rows.jsonl``; see [the bench](../bench.md).
"""

import numpy as np

import vsep
from vsep.bench.methods import read_method
from vsep.bench.table import bench_measures, bench_table


def nearest_ramp(received: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Put the sample of the nearest ramp in which it is clean in the place of a flagged one."""
    ramps = np.arange(len(received))
    distance = np.abs(ramps[:, None] - ramps)[:, :, None] + np.where(mask, np.inf, 0.0)
    nearest = np.argmin(distance, axis=1)
    return np.where(mask, np.take_along_axis(received, nearest, axis=0), received)


if __name__ == "__main__":
    own = read_method(f"{__name__}:nearest_ramp")
    study = vsep.bench_study(scenes=["simulation-2-b"], methods=[own, "zeroing"], frames=4)
    rows = [row for trial in vsep.record_study(study, "rows.jsonl") for row in trial]
    print(bench_table(rows))
    gtnr = {one.method: one.interval.value for one in bench_measures(rows) if one.metric == "gtnr"}
    assert gtnr["nearest_ramp"] > gtnr["zeroing"]
