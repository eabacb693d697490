import io

import numpy as np
import pytest

from app.report.recipe import KeptFrame, Recipe, read_recipe
from app.report.run import account, carry_out, listed_settings
from app.report.snapshot import KINDS, make_snapshot, snapshot_recipe
from app.report.write import report_bytes
from app.settings import LOADED_FRAME, Settings
from vsep.cli import main
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


def test_a_run_of_several_antennas_is_drawn_as_the_one_shown(tmp_path):
    path = tmp_path / "array.npz"
    scene = ["--preset", "simulation-2-a", "--antennas", "3", "--snr-db", "50"]
    assert main(["simulate", *scene, "--out", str(path)]) == 0
    kept = KeptFrame(name="array.npz", content=path.read_bytes())
    plan = Settings(preset=LOADED_FRAME, max_iterations=3).plan()
    recipe = Recipe(plan=plan, frame=kept, antenna=2, together=True)
    run = carry_out(recipe)
    received = read_frame(path).antennas
    assert run.state.object_signal.shape == (48, 128)
    np.testing.assert_array_equal(run.seen.object_signal, run.state.object_signal[32:])
    picture = run.picture()
    assert picture.backdrop.antenna.number == 2
    np.testing.assert_array_equal(picture.backdrop.observation.received, received[2])
    told = account(run)
    assert "angle_deg" in told["result"]["objects"][0]
    assert read_recipe(told["recipe"], "a report") == recipe
    assert listed_settings(run)["antenna"] == "2 of 3, separated together"
