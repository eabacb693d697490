"""A separability map as a table.

When can object and interference be told apart? Condition (27), the coherence of the two bases and
the loss of the bound, over any two parameters; see [separability](../separability.md). On the
command line: `vsep separability --x ... --y ... --out map.csv`.
"""

import csv

import numpy as np

from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.map import make_separability_map, table_rows
from vsep.separability.map_spec import MapSpec

spec = MapSpec(
    x=parse_axis("sir_db=-40:40:9"),
    y=parse_axis("slope_difference=-2e12:-2e11:5"),
    scene="simulation-1",
    trials=0,
)
found = make_separability_map(spec, analytic_map(spec), {})

rows = table_rows(found)
with open("map.csv", "w", encoding="utf-8", newline="") as file:
    table = csv.DictWriter(file, list(rows[0]))
    table.writeheader()
    table.writerows(rows)

condition_db = found.layers["whole_db"]
lowest, highest = condition_db.min(), condition_db.max()
print(f"{len(rows)} cells; condition (27) from {lowest:.1f} to {highest:.1f} dB")
assert condition_db.shape == (5, 9)
# Both sides of (27) are linear in their levels: one dB of SIR is one dB.
assert np.allclose(np.diff(condition_db, axis=1), 10.0)
