"""Tables that ship: no hand has changed them, and what they are made of is still what is made."""

import csv
import gzip
import json
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest

from tests.vsep.mitigation_tables import DOCUMENT, with_tables
from tests.vsep.readings_bench import study_of
from tests.vsep.result_tables import CHECKSUMS, without_recipe
from vsep._version import __version__
from vsep.files.results import as_json
from vsep.reproduction.claims import judge, limits_text
from vsep.reproduction.figures import FIGURES
from vsep.reproduction.paper_claims import CLAIMS
from vsep.reproduction.recipe import read_recipes, recipe_of, table_checksum
from vsep.studies.catalogue import CATALOGUE, make_study
from vsep.studies.study import TrialSettings
from vsep.studies.summary import summarise
from vsep.studies.trial import run_trial

RESULTS = Path(__file__).parents[2] / "assets" / "results"
ROWS = tuple((RESULTS / "rows").iterdir())
FOLDER = RESULTS / "reproduction"
RECIPES = read_recipes(FOLDER)
# A figure, a point of it and a method: run again as a whole, in a second or two each.
SPOTS = {"3b": (23, "object-only"), "mru-size": (3, "iht")}
MORE_SPOTS = {  # seconds each
    "3a": (8, "object-only"),
    "3c": (30, "object-only"),
    "3b-letter": (23, "no-interference"),
    "5a-c": (14, "no-interference"),
    "5d-f": (19, "no-interference"),
    "repairs": (2, "zeroing"),
    "detectors": (9, "masked"),
    "mru-prior": (2, "ist"),
    "mru-share": (4, "iht"),
    "mru-solver": (3, "ist"),
    "7": (0, "no-interference"),
}


def spot(study, index, method, realizations, settings=None):
    """A study of one point and one method."""
    return make_study(
        study,
        realizations=realizations,
        methods=(method,),
        selection=str(index),
        settings=settings,
    )


OF_STUDIES = {  # the same of the tables of printed commands
    "fig-3ab": spot("fig-3", 8, "object-only", 500),
    "fig-3c": spot("fig-3", 30, "factorised", 500),
    "fig-5": spot("fig-5", 0, "no-interference", 200),
    "fig-5-three-bursts": spot("fig-5", 51, "no-interference", 50),
    "false-alarms": spot("false-alarms", 3, "factorised", 150),
    "baselines": spot("baselines", 8, "masked", 100),
    "fig-3b-paper-schedule": spot("fig-3", 23, "factorised", 500, TrialSettings(schedule="paper")),
    "fig-3b-readings": replace(study_of("weights-follow"), selected=(23,)),
}
NOT_REPEATED = {"seconds", "iteration_ms"}  # of a machine


def lines_of(name, folder=FOLDER):
    with (folder / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("path", sorted(RESULTS.rglob("*.csv")), ids=lambda path: path.stem)
def test_every_table_is_of_the_version_released_here(path):
    versions = {line["version"] for line in lines_of(path.stem, path.parent)}
    minor = __version__.rpartition(".")[0]
    assert {version.rpartition(".")[0] for version in versions} == {minor}


def test_no_hand_has_changed_a_table_without_a_recipe():
    text = (RESULTS / CHECKSUMS).read_text(encoding="utf-8")
    told = dict(reversed(line.split("  ")) for line in text.splitlines())
    made = {name: table_checksum(path) for name, path in without_recipe(RESULTS).items()}
    assert made == told


def test_every_table_has_its_recipe():
    tables = {path.stem for path in FOLDER.glob("*.csv")} - {"claims"}
    assert tables == set(RECIPES)
    assert set(RECIPES) <= set(FIGURES)


@pytest.mark.parametrize("name", RECIPES)
def test_no_hand_has_changed_a_table(name):
    assert table_checksum(FOLDER / f"{name}.csv") == RECIPES[name]["table"]


@pytest.mark.parametrize("name", RECIPES)
def test_a_table_is_of_the_recipe_that_makes_it_today(name):
    study = FIGURES[name].study_of(RECIPES[name]["extent"])
    assert recipe_of(study) == RECIPES[name]["recipe"]
    lines = lines_of(name)
    assert {line["version"] for line in lines} == {RECIPES[name]["version"]}
    assert {int(line["point_index"]) for line in lines} == set(study.point_indices)
    assert {line["method"] for line in lines} <= set(study.methods)


@pytest.mark.scenario
@pytest.mark.parametrize("name", SPOTS)
def test_a_spot_that_is_run_again_gives_what_the_table_says(name):
    require_same(name, *SPOTS[name])


@pytest.mark.slow  # `make test` runs two of them again
@pytest.mark.parametrize("name", MORE_SPOTS)
def test_a_spot_of_every_other_table_gives_what_it_says(name):
    require_same(name, *MORE_SPOTS[name])


def test_every_table_of_a_study_has_a_spot():
    of_studies = {
        path.stem
        for path in RESULTS.glob("*.csv")
        if path.read_text(encoding="utf-8").startswith("study,")
    }
    assert of_studies == set(OF_STUDIES)


@pytest.mark.slow  # `make test` runs spots of the tables of the reproduction
@pytest.mark.parametrize("name", OF_STUDIES)
def test_a_spot_of_every_table_of_a_study_gives_what_it_says(name):
    require_rows(OF_STUDIES[name], lines_of(name, RESULTS))


def require_same(name, index, method):
    """Run a point and a method of a table again, all realisations, and compare."""
    study = FIGURES[name].study_of(RECIPES[name]["extent"])
    alone = spot(study.name, index, method, study.realizations, study.settings)
    require_rows(alone, lines_of(name))


def require_rows(alone, lines):
    """Run a study of one point and method and compare with the lines of its table."""
    (index,), (method,) = alone.point_indices, alone.methods
    rows = [
        row for number in range(alone.realizations) for row in run_trial(alone.trial(index, number))
    ]
    again = {measure.metric: measure.interval for measure in summarise(rows)}
    told = {
        line["metric"]: line
        for line in lines
        if (int(line["point_index"]), line["method"]) == (index, method)
    }
    assert len(told) >= 8
    for metric, line in told.items():
        if metric in again and metric not in NOT_REPEATED:
            interval = again[metric]
            assert int(line["realizations"]) == interval.num_samples
            for end in ("value", "low", "high"):
                measured = getattr(interval, end)
                if math.isfinite(measured):
                    assert float(line[end]) == pytest.approx(measured, rel=1e-4, abs=1e-9), metric


@pytest.mark.parametrize("file", ROWS, ids=[file.name for file in ROWS])
def test_shipped_rows_are_those_of_this_release_run_again(file):
    rows = [json.loads(line) for line in gzip.decompress(file.read_bytes()).splitlines()]
    assert file.name.removesuffix(".jsonl.gz") in CATALOGUE
    assert {row["version"] for row in rows} == {__version__}
    assert {row["status"] for row in rows} == {"done"}
    for row in random.Random(1).sample(rows, 6):
        study = make_study(row["study"], methods=(row["method"],))
        (again,) = run_trial(study.trial(row["point_index"], row["realization"]))
        again = json.loads(as_json(again))
        for key in row.keys() - NOT_REPEATED:
            expected = row[key]
            if isinstance(expected, int | float | list):
                expected = pytest.approx(expected, rel=1e-4, abs=1e-9)
            assert again[key] == expected, key


def test_the_table_of_claims_is_that_of_the_document_and_of_todays_claims():
    claims = lines_of("claims")
    made = [claim for claim in CLAIMS if claim.figure in RECIPES]
    assert [(line["figure"], line["says"]) for line in claims] == [
        (claim.figure, claim.says) for claim in made
    ]
    document = (FOLDER.parents[1] / "docs" / "reproduction.md").read_text(encoding="utf-8")
    for line, finding in zip(claims, judge(made, {}), strict=True):
        (row,) = [
            text for text in document.splitlines() if text.startswith("| ") and line["says"] in text
        ]
        assert row.endswith(f"| {line['verdict']} |")
        assert limits_text(finding.claim.claimed) in row
        value = float(line["value"])
        assert f"{value:.3g}" in row
        # The claim's figure is one of its table, but for a place between points.
        if finding.claim.pick != "crossing":
            assert any(
                float(other["value"]) == pytest.approx(value, rel=1e-6)
                for other in lines_of(line["figure"])
                if (other["method"], other["metric"]) == (line["method"], line["metric"])
            )


def test_the_tables_of_the_document_on_mitigation_are_those_of_the_files():
    text = DOCUMENT.read_text(encoding="utf-8")
    assert with_tables(text) == text
