"""``vsep bench``."""

from vsep_app.cli.main import main

from vsep.bench.scenes import SCENES
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


def test_without_a_file_it_says_what_is_missing(capsys):
    assert main(["bench"]) == 2
    assert "--out is missing" in capsys.readouterr().err
