import io

import numpy as np
import pytest

from app.report.recipe import KeptFrame, Recipe
from app.report.run import carry_out
from app.report.snapshot import KINDS, make_snapshot, snapshot_recipe
from app.report.write import report_bytes
from vsep.files.frame import read_frame


@pytest.fixture
def shown(one_ramp):
    """The live view, paused at iteration 2."""
    return one_ramp.snapshot(2)


def test_a_snapshot_is_the_report_of_what_is_shown(shown):
    recipe = snapshot_recipe(shown, Recipe(plan=shown.opening.plan), 99)
    assert (recipe.iteration, recipe.ramp) == (2, 0)
    again = carry_out(recipe)
    for key in ("html", "png", "json"):
        made = make_snapshot(key, recipe)
        assert made.name == f"vsep-simulation-1-7-iteration-2.{key}"
        assert made.content == report_bytes(again, f".{key}")
    assert set(KINDS) == {"html", "png", "json", "npz"}


def test_a_run_that_has_ended_is_shown_to_its_end(one_ramp):
    recipe = snapshot_recipe(one_ramp.snapshot(), Recipe(plan=one_ramp.prepared.plan), 0)
    assert recipe.iteration is None


def test_the_frame_file_is_the_frame_with_the_assumed_filter(shown):
    recipe = snapshot_recipe(shown, Recipe(plan=shown.opening.plan), 0)
    made = make_snapshot("npz", recipe)
    frame = read_frame(io.BytesIO(made.content), name=made.name)
    assert np.array_equal(frame.received, shown.opening.observation.received)
    assert frame.anti_aliasing_filter == shown.opening.estimator.model.anti_aliasing_filter
    assert make_snapshot("npz", recipe).content == made.content


def test_a_loaded_frame_comes_back_as_it_was(shown):
    recipe = snapshot_recipe(shown, Recipe(plan=shown.opening.plan), 0)
    content = make_snapshot("npz", recipe).content
    loaded = Recipe(plan=recipe.plan, frame=KeptFrame(name="a.npz", content=content))
    assert make_snapshot("npz", loaded).content is content
