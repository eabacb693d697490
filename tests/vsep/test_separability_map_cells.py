import threading

import numpy as np
import pytest

from vsep import InputError
from vsep.separability import cells as separability_cells
from vsep.separability.analytic import analytic_map
from vsep.separability.axes import parse_axis
from vsep.separability.cells import cells_coarse_to_fine, coarser, compute_map, summarise_cell
from vsep.separability.map import LAYERS, make_separability_map, table_rows
from vsep.separability.map_cache import MapCache
from vsep.separability.map_spec import MapSpec
from vsep.studies.trial import failed_rows, run_trial


def spec(x="sir_db=-40:40:3", y="snr_db=20:60:3", **changes):
    values = {"method": "object-only", "trials": 2} | changes
    return MapSpec(x=parse_axis(x), y=parse_axis(y), **values)


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

    monkeypatch.setattr(separability_cells, "run_on_processes", run)
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


def test_cell_results_are_those_of_the_trials_alone(made):
    maps = spec()
    found = {cell_result.cell: cell_result for cell_result in compute_map(maps)}
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
    maps = spec("interfered_share=0.5:0.51:2", "sir_db=0:1:2", scene="simulation-2-a", trials=1)
    found = list(compute_map(maps))
    assert [cell_result.cell for cell_result in found] == [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert len(made) == 2


def test_what_is_known_is_not_made_again_and_nothing_is_without_trials(made):
    known = set(cells_coarse_to_fine(3, 3)) - {(1, 1)}
    assert [cell_result.cell for cell_result in compute_map(spec(), known=known)] == [(1, 1)]
    assert len(made) == 2
    assert list(compute_map(spec(trials=0))) == []


def test_a_stop_ends_the_cells(made):
    stop = threading.Event()
    for cell_result in compute_map(spec(), stop=stop):
        assert cell_result.cell == (0, 0)
        stop.set()
    assert len(made) == 2


def test_failed_trials_are_counted_and_measure_nothing():
    maps = spec()
    cell_result = summarise_cell((0, 0), failed_rows(maps.trial((0, 0)), "on purpose"))
    assert (cell_result.num_trials, cell_result.num_failed) == (1, 1)
    assert np.isnan(
        [cell_result.detection, cell_result.false_alarms, cell_result.rmse_over_crlb]
    ).all()


@pytest.mark.usefixtures("made")
def test_cache_forget_the_spec_longest_not_asked():
    cache = MapCache(most=2)
    first, second, third = (spec(trials=trials) for trials in (1, 2, 3))
    for maps in (first, second):
        cache.add(maps, next(compute_map(maps)))
    assert list(cache.of(first)) == [(0, 0)]
    cache.add(third, next(compute_map(third)))
    assert cache.of(second) == {}
    with pytest.raises(InputError, match="Number of maps is 0"):
        MapCache(most=0)


@pytest.mark.usefixtures("made")
def test_a_map_shows_the_coarse_grid_until_the_fine_one_is_there():
    maps = spec()
    cell_result = next(compute_map(maps))
    separability_map = make_separability_map(
        maps, analytic_map(maps), {cell_result.cell: cell_result}
    )
    detection = separability_map.layers["detection"]
    # The corner stands for its block of two by two cells.
    np.testing.assert_array_equal(np.isfinite(detection), [[1, 1, 0], [1, 1, 0], [0, 0, 0]])
    assert separability_map.finished.sum() == 1
    rows = table_rows(separability_map)
    assert len(rows) == 9
    assert [row["detection"] is None for row in rows].count(True) == 8
    assert (rows[5]["sir_db"], rows[5]["snr_db"], rows[5]["trials"]) == (40.0, 40.0, 0)
    assert set(LAYERS) <= set(rows[0])


def test_colours_reach_as_far_as_the_values_but_not_for_ever():
    maps = spec(trials=0)
    separability_map = make_separability_map(maps, analytic_map(maps), {})
    assert separability_map.limits("whole_db") == (-40.0, 40.0)
    assert separability_map.limits("detection") == (0.0, 1.0)
    assert separability_map.limits("coherence") == (
        0.0,
        pytest.approx(separability_map.layers["coherence"].max()),
    )
