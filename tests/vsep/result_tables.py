"""Tables of assets/results that scripts write, and the checksums of all that no recipe has.

As a script it writes the checksums, after every table that was made again:

    python -m tests.vsep.result_tables assets/results
"""

import csv
import sys
from pathlib import Path

from vsep._version import __version__
from vsep.reproduction.recipe import read_recipes, table_checksum

CHECKSUMS = "checksums.txt"
# A table is read by people; intervals are wider than the sixth digit.
_SIGNIFICANT_DIGITS = 6


def table_line(row):
    """Texts of a row by column: floats in six digits, and the version that made them."""
    return {
        name: f"{value:.{_SIGNIFICANT_DIGITS}g}" if isinstance(value, float) else str(value)
        for name, value in (row | {"version": __version__}).items()
    }


def write_table(path, rows):
    """Write rows, dictionaries of one set of columns, each as soon as it is there."""
    with Path(path).open("w", newline="", encoding="utf-8") as stream:
        table = None
        for line in map(table_line, rows):
            if table is None:
                table = csv.DictWriter(stream, fieldnames=list(line), lineterminator="\n")
                table.writeheader()
            table.writerow(line)
            stream.flush()


def without_recipe(folder):
    """Return the tables of a folder of results that stand in no list of recipes, by name."""
    reproduction = folder / "reproduction"
    made = {reproduction / f"{name}.csv" for name in read_recipes(reproduction)}
    paths = set(folder.rglob("*.csv")) - made
    return {path.relative_to(folder).as_posix(): path for path in sorted(paths)}


def main(folder):
    """Write the checksums, as sha256sum does."""
    lines = [f"{table_checksum(path)}  {name}\n" for name, path in without_recipe(folder).items()]
    (folder / CHECKSUMS).write_text("".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
