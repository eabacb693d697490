"""Tables of assets/results that scripts write: the documents print them, and spots made again."""

import csv
from itertools import islice
from pathlib import Path

import pytest

from tests.vsep import (
    antenna_bench,
    impaired_bench,
    interference_cost,
    recording_bench,
    timing_scenes,
)
from tests.vsep.result_tables import table_line, write_table

ASSETS = Path(__file__).parents[2] / "assets"
METHODS = ("factorised", "evidence", "autoregressive", "residual")
SLOW = pytest.mark.slow  # `make test` makes a spot of the first table again
# Table, the line from which on it is made again, and by what.
SPOTS = [
    pytest.param("antennas", 0, lambda: islice(antenna_bench.rows(), 1)),
    pytest.param("impaired-bursts", 4, lambda: [impaired_bench.row_of("long")], marks=SLOW),
    pytest.param("interference-cost", 5, lambda: interference_cost.rows_of(23), marks=SLOW),
    pytest.param("interferer-timing", 12, lambda: timing_scenes.rows_of(-19e12, 14.0), marks=SLOW),
    pytest.param(
        "recording-20180608", 0, lambda: islice(recording_bench.car_rows(), 1), marks=SLOW
    ),
    pytest.param(
        "recording-20180613-bursts",
        0,
        lambda: recording_bench.sweep_rows((20e12,), (-40.0,)),
        marks=SLOW,
    ),
]


def kept(name):
    with (ASSETS / "results" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def number(text):
    """The number that a text is, else the text."""
    try:
        return float(text)
    except ValueError:
        return text


def figure(row, name, digits=2, low="low", high="high", scale=1.0):
    """A figure and its interval as the documents print them."""
    value, *ends = (f"{scale * float(row[key]) + 0.0:.{digits}f}" for key in (name, low, high))
    return f"{value} [{', '.join(ends)}]"


def of_antennas():
    """Lines of antennas.md."""
    rows = {(row["what"], row["antennas"], row["snr_db"]): row for row in kept("antennas")}
    for shape in ("1 x 256", "16 x 128"):
        what = f"false alarms a frame of noise, {shape}, 0.05 asked"
        yield [shape, *(figure(rows[what, count, ""], "value", 3) for count in "1248")]
    levels = 11, 12, 13, 14, 16
    for label, count, below in (
        ("one antenna", "1", 0),
        ("four, 5 dB below", "4", 5),
        ("four, 6 dB below", "4", 6),
    ):
        places = [("detection, SIR -20 dB", count, str(level - below)) for level in levels]
        yield [label, *(figure(rows[place], "value") for place in places)]
    for label, what, name, is_of_one in (
        ("Simulation I, 30 and 24 dB: RMSE over bound, delay", "beat RMSE", "1", True),
        ("angle", "angle RMSE", "1", False),
        ("Simulation II a, 60 and 54 dB: RMSE over bound, delay", "beat RMSE", "2-a", True),
        ("angle", "angle RMSE", "2-a", False),
        ("misses a frame (of 10 objects)", "misses a frame", "2-a", True),
        ("false alarms a frame", "false alarms a frame", "2-a", True),
    ):
        bound = " over its bound" if "RMSE" in what else ""
        where = f"{what}{bound}, simulation-{name}"
        levels = ("30", "24") if name == "1" else ("60", "54")
        one = figure(rows[where, "1", levels[0]], "value") if is_of_one else ""
        yield [label, one, figure(rows[where, "4", levels[1]], "value")]


def of_impaired_bursts():
    """Lines of mitigation.md."""
    for row in kept("impaired-bursts"):
        missed = {name: f"{float(row[f'missed_{name}']):.2f}" for name in METHODS}
        more = [
            figure(row, name, low=f"{name}_low", high=f"{name}_high")
            for name in (f"more_than_{other}" for other in METHODS if other != "evidence")
        ]
        within = [
            figure(row, name, 1, f"{name}_low", f"{name}_high", 100.0)
            for name in ("within_1", "within_2")
        ]
        both = f"{missed['autoregressive']}, {missed['residual']}"
        share = f"{100.0 * float(row['separation_kept']):.0f} %"
        yield [
            row["bursts"],
            missed["factorised"],
            missed["evidence"],
            both,
            *more,
            share,
            *within,
        ]


def of_timing():
    """Lines of recordings.md."""
    rows = kept("interferer-timing")
    levels = ("9", "10", "11", "12", "13", "14")
    for slope, label in ((-19e12, "19 MHz/µs: "), (-6e12, "6 MHz/µs: ")):
        for method, start in (("search alone", label), ("with the timing", "")):
            found = {
                row["energy_db"]: figure(row, "found")
                for row in rows
                if (float(row["slope_difference_hz_per_s"]), row["method"]) == (slope, method)
            }
            yield [f"{start}{method}", *(found[level] for level in levels)]


def of_recordings():
    """Lines of calibration.md."""
    for row in kept("recording-20180608"):
        levels = [
            f"{float(row[f'sir_{name}_db']):.1f}"
            for name in (
                "received",
                "zeroed",
                "cleaned",
                "cleaned_own_response",
                "cleaned_clutter_kept",
            )
        ]
        floors = [
            f"{float(row[name]):.2f} dB"
            for name in ("floor_over_clean_ramps_db", "floor_of_hit_ramps_db")
        ]
        yield [row["antenna"], *levels, *floors]
    for row in kept("recording-20180613-bursts"):
        counts = [
            f"{row[f'{name}_missed']} / {row[f'{name}_stray']}"
            for name in ("separation", "zeroing", "masked")
        ]
        share = f"{100.0 * float(row['mask_share']):.0f} %"
        slope, sir_db = row["slope_difference_mhz_per_us"], row["sir_db"]
        yield [slope, f"{sir_db} dB", share, *counts]


PRINTED = {
    "antennas": of_antennas,
    "mitigation": of_impaired_bursts,
    "recordings": of_timing,
    "calibration": of_recordings,
}


@pytest.mark.parametrize("document", PRINTED)
def test_the_document_prints_what_the_table_holds(document):
    text = (ASSETS / "docs" / f"{document}.md").read_text(encoding="utf-8")
    printed = text.replace("\N{MINUS SIGN}", "-").splitlines()
    lines = ["| {} |".format(" | ".join(cells)) for cells in PRINTED[document]()]
    assert [line for line in lines if line.replace("|  |", "| |") not in printed] == []


@pytest.mark.parametrize(("name", "first", "rows"), SPOTS)
def test_a_spot_that_is_made_again_gives_what_the_table_says(name, first, rows):
    again = [table_line(row) for row in rows()]
    assert again
    for line, told in zip(again, kept(name)[first:], strict=False):
        assert list(line) == list(told)
        for column, text in told.items():
            expected = number(text)
            if isinstance(expected, float):  # of another machine
                expected = pytest.approx(expected, rel=1e-4, abs=1e-9)
            assert number(line[column]) == expected, column


def test_every_table_of_a_script_has_a_spot():
    of_scripts = {
        path.stem
        for path in (ASSETS / "results").glob("*.csv")
        if not path.read_text(encoding="utf-8").startswith("study,")
    }
    assert of_scripts == {spot.values[0] for spot in SPOTS}


def test_a_table_has_a_column_of_the_version(tmp_path):
    write_table(tmp_path / "table.csv", [{"what": "a", "value": 2.0 / 3.0, "frames": 7}])
    text = (tmp_path / "table.csv").read_text(encoding="utf-8")
    assert text.startswith("what,value,frames,version\na,0.666667,7,")
