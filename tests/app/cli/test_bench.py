"""``vsep bench``."""

import numpy as np
import pytest
from vsep_app.cli.main import main

from vsep.bench.export import OPEN_SET
from vsep.bench.scenes import SCENES
from vsep.files.frame import read_frame
from vsep.studies.rows import read_rows

SCENE = "one-ramp-snr+0-inr+20"
MODULE = "import numpy as np\n\n\ndef halved(received, mask):\n    return received / (1.0 + mask)\n"


def test_the_list_names_every_scene(capsys):
    assert main(["bench", "--list"]) == 0
    listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert listed == [scene.name for scene in SCENES]


def test_a_method_of_a_module_in_this_folder_is_measured_and_resumed(tmp_path, monkeypatch, capsys):
    (tmp_path / "own_work.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    words = ["bench", "--scenes", SCENE, "--frames", "2", "--out", "rows.jsonl"]
    words += ["--method", "own_work:halved", "--method", "no-interference"]
    assert main(words) == 0
    table = capsys.readouterr().out
    assert f"| {SCENE} | halved | 2 |" in table
    before = read_rows("rows.jsonl")
    assert len(before) == 4
    assert main(words) == 0
    assert capsys.readouterr().out == table
    assert read_rows("rows.jsonl") == before


def test_the_open_set_that_is_shipped_is_small_whole_and_made_by_the_command(tmp_path, repository):
    assert main(["bench", "--export", str(tmp_path)]) == 0
    shipped = repository / "assets/open-set"
    frames = sorted(shipped.glob("*.npz"))
    sheet = (shipped / "datasheet.md").read_text()
    assert sheet == (tmp_path / "datasheet.md").read_text()
    assert sum(path.stat().st_size for path in frames) < 3_000_000
    assert {path.stem for path in frames} == {f"{name}-0" for name in OPEN_SET}
    for path in frames:
        assert path.name in sheet
        frame = read_frame(path)
        truth = frame.truth
        rest = frame.received - truth.object_signal - truth.interference_signal
        # Of the recorded frame the object signal holds the noise.
        power = 0.0 if path.stem == "semi-real-0" else 1.0
        assert np.mean(np.abs(rest) ** 2) * truth.noise_precision == pytest.approx(power, abs=0.15)
        assert np.array_equal(frame.truth_mask, truth.perfect_mask())
        again = read_frame(tmp_path / path.name)
        np.testing.assert_allclose(frame.received, again.received, rtol=1e-9)
    assert "CC BY 4.0" in sheet
    assert "Apache\nLicense" in sheet


def test_without_a_file_it_says_what_is_missing(capsys):
    assert main(["bench"]) == 2
    assert "--out is missing" in capsys.readouterr().err
