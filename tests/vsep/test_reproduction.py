"""Claims of the papers and their verdicts."""

from math import inf, nan

import pytest

from vsep import InputError
from vsep.analysis.intervals import Interval
from vsep.reproduction.claims import Claim, judge, limits_text, verdict_of
from vsep.reproduction.figures import FIGURES, chosen_figures
from vsep.reproduction.paper_claims import CLAIMS
from vsep.reproduction.table import command_of, finding_lines, findings_markdown
from vsep.studies.measures import METRICS
from vsep.studies.trial import failed_rows


def interval(value, low, high):
    return Interval(
        value=value, low=low, high=high, level=0.95, method="bootstrap percentile", num_samples=9
    )


@pytest.mark.parametrize(
    ("measured", "claimed", "verdict"),
    [
        ((1.0, 0.9, 1.3), (0.85, 1.1), "reproduced"),
        ((1.2, 1.0, 1.4), (0.85, 1.1), "undecided"),
        ((1.4, 1.2, 1.6), (0.85, 1.1), "not reproduced"),
        ((0.5, 0.2, 0.8), (0.85, 1.1), "not reproduced"),
        ((nan, nan, nan), (0.0, 1.0), "not measured"),
        # Without an interval the figure alone decides.
        ((2.0, nan, nan), (0.0, 1.0), "not reproduced"),
    ],
)
def test_the_verdict_is_that_of_figure_and_interval(measured, claimed, verdict):
    assert verdict_of(interval(*measured), claimed) == verdict


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.says[:40])
def test_a_claim_measures_what_its_figure_has(claim):
    study = FIGURES[claim.figure].study_of("quick")
    assert claim.metric in METRICS
    assert claim.method in study.methods
    assert claim.claimed[0] < claim.claimed[1]
    points = [study.points[index].parameters() for index in study.point_indices]
    assert any(claim.is_about(point) for point in points)


def test_quick_takes_a_quarter_of_an_hour_on_two_cores():
    seconds = [figure.duration_s("quick", workers=2) for figure in FIGURES.values()]
    assert sum(seconds) < 15 * 60
    assert all(figure.quick <= figure.full for figure in FIGURES.values())


def rows_with(study, values, metric):
    """One finished row a point, with these values of a metric."""
    rows = []
    for index, value in zip(study.point_indices, values, strict=True):
        trial = study.trial(index, 0)
        rows += [
            {**row, "status": "done", "num_objects_true": 10, metric: value}
            for row in failed_rows(trial, "")
            if row["method"] == "factorised"
        ]
    return rows


def test_of_several_points_the_largest_counts_or_where_the_figure_crosses_zero():
    study = FIGURES["5d-f"].study_of("quick")
    levels = [study.points[index].sir_db for index in study.point_indices]
    of = {"figure": "5d-f", "section": "IV", "says": "", "method": "factorised"}
    largest = Claim(**of, claimed=(0.0, 30.0), metric="sinr_db", where={"sir_db": (-inf, 30.0)})
    crossing = Claim(
        **of,
        claimed=(-inf, inf),
        metric="separability_db",
        where={"sir_db": (-40.0, 40.0)},
        pick="crossing",
    )
    rows = [
        {**row, "separability_db": row["point"]["sir_db"] - 7.0}
        for row in rows_with(study, levels, "sinr_db")
    ]
    first, second = judge([largest, crossing], {"5d-f": rows})
    assert (first.interval.value, first.verdict) == (30.0, "reproduced")
    assert second.interval.value == pytest.approx(7.0)


def test_the_table_says_what_is_claimed_and_how_it_is_made():
    findings = judge(CLAIMS[:2], {})
    text = findings_markdown(findings, made="vsep reproduce", machine="Here.")
    assert text.count("not measured") == 3
    assert command_of(CLAIMS[0].figure) in text
    assert [line["verdict"] for line in finding_lines(findings)] == ["not measured"] * 2
    assert limits_text((1.0, inf)) == "at least 1"


def test_an_unknown_figure_is_refused():
    with pytest.raises(InputError, match="figure is '9'; it must be one of 1, 2, "):
        chosen_figures(["9"])
