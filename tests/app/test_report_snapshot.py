import io

import numpy as np
import pytest
from vsep_app.cli.main import main
from vsep_app.model.settings import LOADED_FRAME, Settings
from vsep_app.report.run import execute, listed_settings, provenance
from vsep_app.report.snapshot import KINDS, make_snapshot, snapshot_spec
from vsep_app.report.spec import KeptFrame, ReportSpec, read_spec
from vsep_app.report.write import report_bytes

from vsep.files.frame import read_frame


@pytest.fixture
def shown(one_ramp):
    """The live view, paused at iteration 2."""
    return one_ramp.snapshot(2)


def test_a_snapshot_is_the_report_of_what_is_shown(shown):
    spec = snapshot_spec(shown, ReportSpec(plan=shown.prepared_run.plan), 99)
    assert (spec.iteration, spec.ramp) == (2, 0)
    again = execute(spec)
    for key in ("html", "png", "json"):
        made = make_snapshot(key, spec)
        assert made.name == f"vsep-simulation-1-7-iteration-2.{key}"
        assert made.content == report_bytes(again, f".{key}")
    assert set(KINDS) == {"html", "png", "json", "npz"}


def test_a_run_that_has_ended_is_shown_to_its_end(one_ramp):
    spec = snapshot_spec(one_ramp.snapshot(), ReportSpec(plan=one_ramp.prepared.plan), 0)
    assert spec.iteration is None


def test_the_frame_file_is_the_frame_with_the_assumed_filter(shown):
    spec = snapshot_spec(shown, ReportSpec(plan=shown.prepared_run.plan), 0)
    made = make_snapshot("npz", spec)
    frame = read_frame(io.BytesIO(made.content), name=made.name)
    assert np.array_equal(frame.received, shown.prepared_run.observation.received)
    assert frame.anti_aliasing_filter == shown.prepared_run.estimator.model.anti_aliasing_filter
    assert make_snapshot("npz", spec).content == made.content


def test_a_loaded_frame_comes_back_as_it_was(shown):
    spec = snapshot_spec(shown, ReportSpec(plan=shown.prepared_run.plan), 0)
    content = make_snapshot("npz", spec).content
    loaded = ReportSpec(plan=spec.plan, frame=KeptFrame(name="a.npz", content=content))
    assert make_snapshot("npz", loaded).content is content


def test_a_run_of_several_antennas_is_drawn_as_the_one_shown(tmp_path):
    path = tmp_path / "array.npz"
    scene = ["--preset", "simulation-2-a", "--antennas", "3", "--snr-db", "50"]
    assert main(["simulate", *scene, "--out", str(path)]) == 0
    kept = KeptFrame(name="array.npz", content=path.read_bytes())
    plan = Settings(preset=LOADED_FRAME, max_iterations=3).plan()
    spec = ReportSpec(plan=plan, frame=kept, antenna=2, together=True)
    run = execute(spec)
    received = read_frame(path).antennas
    assert run.state.object_signal.shape == (48, 128)
    np.testing.assert_array_equal(run.seen.object_signal, run.state.object_signal[32:])
    picture = run.picture()
    assert picture.static_picture.antenna.number == 2
    np.testing.assert_array_equal(picture.static_picture.observation.received, received[2])
    told = provenance(run)
    assert "angle_deg" in told["result"]["objects"][0]
    assert read_spec(told["spec"], "a report") == spec
    assert listed_settings(run)["antenna"] == "2 of 3, separated together"
