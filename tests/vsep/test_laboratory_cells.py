import threading

import numpy as np
import pytest

from vsep import InputError
from vsep.laboratory import cells as laboratory_cells
from vsep.laboratory.analytic import analytic_map
from vsep.laboratory.answers import Answers
from vsep.laboratory.atlas import LAYERS, make_atlas, table_rows
from vsep.laboratory.axes import parse_axis
from vsep.laboratory.cells import cells_coarse_to_fine, coarser, explore, summarise_cell
from vsep.laboratory.question import Question
from vsep.studies.trial import failed_rows, run_trial


def question(x="sir_db=-40:40:3", y="snr_db=20:60:3", **changes):
    values = {"method": "object-only", "trials": 2} | changes
    return Question(x=parse_axis(x), y=parse_axis(y), **values)


@pytest.fixture
def made(monkeypatch):
    """Trials that were made, in this process."""
    trials = []

    def run(waiting, *, workers, stop):
        del workers
        for trial in waiting:
            if stop is not None and stop.is_set():
                return
            trials.append(trial)
            yield run_trial(trial)

    monkeypatch.setattr(laboratory_cells, "run_on_processes", run)
    return trials


@pytest.mark.parametrize("shape", [(2, 2), (9, 5), (33, 17), (20, 16)])
def test_every_cell_comes_once_and_coarse_grids_first(shape):
    order = cells_coarse_to_fine(*shape)
    assert len(order) == len(set(order)) == shape[0] * shape[1]
    seen = set()
    for cell in order:
        seen.add(cell)
        # All blocks that a cell lies in have been drawn by their corner before.
        assert set(coarser(cell, *shape)) <= seen
    # The first grid has steps of at least half the map.
    assert 2 * max(max(cell) for cell in order[:4]) >= max(shape) - 1


def test_findings_are_those_of_the_trials_alone(made):
    maps = question()
    found = {finding.cell: finding for finding in explore(maps)}
    assert len(found) == 9
    assert len(made) == 18
    rows = [row for r in range(2) for row in run_trial(maps.trial((2, 1), r))]
    assert found[2, 1] == summarise_cell((2, 1), rows)
    assert found[2, 1].detection == 1.0
    errors = [row["errors"][0] for row in rows]
    bounds = [row["root_crlb"] for row in rows]
    expected = np.sqrt(np.mean(np.square(errors)) / np.mean(np.square(bounds)))
    # Rows have seven digits.
    assert found[2, 1].rmse_over_crlb == pytest.approx(expected, rel=1e-6)


def test_cells_of_one_scene_are_made_once(made):
    maps = question("interfered_share=0.5:0.51:2", "sir_db=0:1:2", scene="simulation-2-a", trials=1)
    found = list(explore(maps))
    assert [finding.cell for finding in found] == [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert len(made) == 2


def test_what_is_known_is_not_made_again_and_nothing_is_without_trials(made):
    known = set(cells_coarse_to_fine(3, 3)) - {(1, 1)}
    assert [finding.cell for finding in explore(question(), known=known)] == [(1, 1)]
    assert len(made) == 2
    assert list(explore(question(trials=0))) == []


def test_a_stop_ends_the_cells(made):
    stop = threading.Event()
    for finding in explore(question(), stop=stop):
        assert finding.cell == (0, 0)
        stop.set()
    assert len(made) == 2


def test_failed_trials_are_counted_and_measure_nothing():
    maps = question()
    finding = summarise_cell((0, 0), failed_rows(maps.trial((0, 0)), "on purpose"))
    assert (finding.num_trials, finding.num_failed) == (1, 1)
    assert np.isnan([finding.detection, finding.false_alarms, finding.rmse_over_crlb]).all()


@pytest.mark.usefixtures("made")
def test_answers_forget_the_question_longest_not_asked():
    answers = Answers(most=2)
    first, second, third = (question(trials=trials) for trials in (1, 2, 3))
    for maps in (first, second):
        answers.add(maps, next(explore(maps)))
    assert list(answers.of(first)) == [(0, 0)]
    answers.add(third, next(explore(third)))
    assert answers.of(second) == {}
    with pytest.raises(InputError, match="Number of questions is 0"):
        Answers(most=0)


@pytest.mark.usefixtures("made")
def test_a_map_shows_the_coarse_grid_until_the_fine_one_is_there():
    maps = question()
    finding = next(explore(maps))
    atlas = make_atlas(maps, analytic_map(maps), {finding.cell: finding})
    detection = atlas.layers["detection"]
    # The corner stands for its block of two by two cells.
    np.testing.assert_array_equal(np.isfinite(detection), [[1, 1, 0], [1, 1, 0], [0, 0, 0]])
    assert atlas.finished.sum() == 1
    rows = table_rows(atlas)
    assert len(rows) == 9
    assert [row["detection"] is None for row in rows].count(True) == 8
    assert (rows[5]["sir_db"], rows[5]["snr_db"], rows[5]["trials"]) == (40.0, 40.0, 0)
    assert set(LAYERS) <= set(rows[0])


def test_colours_reach_as_far_as_the_values_but_not_for_ever():
    maps = question(trials=0)
    atlas = make_atlas(maps, analytic_map(maps), {})
    assert atlas.limits("whole_db") == (-40.0, 40.0)
    assert atlas.limits("detection") == (0.0, 1.0)
    assert atlas.limits("coherence") == (0.0, pytest.approx(atlas.layers["coherence"].max()))
