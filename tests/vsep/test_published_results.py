"""Tables in assets/results: the printed commands make them, and the document prints them."""

import csv
import re
import shlex
from collections import Counter, defaultdict
from pathlib import Path

import pytest
from vsep_app.cli import main as cli

from tests.vsep.readings_bench import READINGS as SCRIPT
from tests.vsep.readings_bench import study_of
from vsep.studies.catalogue import make_study

ASSETS = Path(__file__).parents[2] / "assets"
TEXT = (ASSETS / "docs/results.md").read_text(encoding="utf-8").replace("\N{MINUS SIGN}", "-")


def printed_commands():
    """Options of every `vsep study` command of the document, in their order."""
    lines = [line for line in TEXT.splitlines() if line.startswith("vsep study ")]
    return [cli.parse(shlex.split(line)[1:]) for line in lines]


def planned():
    """Realisations by table, then by point and method, as the printed commands make them."""
    tables, rows = {}, defaultdict(Counter)
    for options in printed_commands():
        if hasattr(options, "study"):
            study = make_study(
                options.study,
                realizations=options.realizations,
                methods=options.estimator,
                selection=options.points,
            )
            for index in study.point_indices:
                for method in study.methods:
                    most = max(rows[options.out][index, method], study.realizations)
                    rows[options.out][index, method] = most
        elif options.out.endswith(".csv"):
            tables[options.out] = rows[options.rows]
    return tables


def kept(name):
    with (ASSETS / "results" / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def realizations_of(name):
    """Realisations of a table by point and method."""
    found = Counter()
    for row in kept(name):
        key = int(row["point_index"]), row["method"]
        found[key] = max(found[key], int(row["realizations"]))
    return found


TABLES = planned()


def test_every_table_of_a_study_has_its_commands():
    of_studies = {
        path.name
        for path in (ASSETS / "results").glob("*.csv")
        if path.read_text(encoding="utf-8").startswith("study,")
    }
    assert of_studies - {"fig-3b-readings.csv"} == set(TABLES)


def test_the_table_of_other_readings_is_that_of_its_script():
    studies = [study_of(name) for name in SCRIPT]
    assert realizations_of("fig-3b-readings.csv") == {
        (index, *study.methods): study.realizations
        for study in studies
        for index in study.point_indices
    }


@pytest.mark.parametrize("name", TABLES)
def test_the_printed_commands_make_what_is_published(name):
    assert realizations_of(name) == TABLES[name]


READINGS = {
    "letter": ("fig-3b-paper-schedule.csv", "factorised"),
    "θ to its end": ("fig-3b-readings.csv", "theta-to-its-end"),
    "β after θ": ("fig-3b-readings.csv", "weights-follow"),
}
METRICS = {
    "found": "detection_rate",
    "RMSE / √CRLB": "rmse_detected_over_crlb",
    "iterations": "iterations",
}


def test_the_table_of_the_letter_is_that_of_the_files():
    lines = TEXT.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| SIR | letter"))
    end = next(i for i in range(start, len(lines)) if not lines[i].startswith("|"))
    head, _, *body = (
        [cell.strip() for cell in line.strip("|").split("|")] for line in lines[start:end]
    )
    assert len(body) == 13
    for column, title in enumerate(head[1:], start=1):
        reading, metric = title.split(": ")
        name, method = READINGS[reading]
        figures = {
            float(row["sir_db"]): [float(row[key]) for key in ("value", "low", "high")]
            for row in kept(name)
            if (row["method"], row["metric"]) == (method, METRICS[metric])
        }
        for cells in body:
            found = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", cells[column])]
            half = 0.5 if metric == "iterations" else 0.005
            assert found == pytest.approx(figures[float(cells[0])], abs=half + 1e-6)


def test_a_thousand_iterations_of_the_letter_are_those_of_the_file():
    found = {
        row["sir_db"]: "{:.2f} [{:.2f}, {:.2f}]".format(
            *(float(row[key]) for key in ("value", "low", "high"))
        )
        for row in kept("fig-3b-readings.csv")
        if (row["method"], row["metric"]) == ("letter-1000", "detection_rate")
    }
    said = "{}, {} and {} of 60 frames each".format(*(found[f"{sir}.0"] for sir in (-50, -40, -30)))
    assert said in " ".join(TEXT.split())


def test_the_table_of_remedies_is_that_of_the_reproduction():
    lines = TEXT.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| misses / false alarms"))
    head, _, *body = (
        [cell.strip() for cell in line.strip("|").split("|")] for line in lines[start : start + 12]
    )
    levels = [float(re.search(r"-?\d+", cell)[0]) for cell in head[1:]]
    figures = {
        (row["method"], float(row["sir_db"]), row["metric"]): float(row["value"])
        for row in kept("reproduction/5d-f.csv")
    }
    assert {cells[0].strip("`") for cells in body} == {key[0] for key in figures}
    for method, *cells in body:
        for level, cell in zip(levels, cells, strict=True):
            printed = [float(number) for number in cell.split("/")]
            made = [figures[method.strip("`"), level, name] for name in ("misses", "false_alarms")]
            assert printed == pytest.approx(made, abs=0.005 + 1e-6)


def test_the_cost_of_interference_is_that_of_its_table():
    with (ASSETS / "results/interference-cost.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 10
    for row in rows:
        value, low, high = (f"{float(row[key]):.3f}" for key in ("value", "low", "high"))
        (line,) = (
            line
            for line in TEXT.splitlines()
            if line.startswith(f"| {row['ratio_to_no_interference']} |")
        )
        assert f"{value} [{low}, {high}]" in line
