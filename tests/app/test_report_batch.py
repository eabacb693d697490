from pathlib import Path

import numpy as np
import pytest
from vsep_app.report.batch import write_batch
from vsep_app.report.metadata import read_provenance
from vsep_app.report.sources import changed, of_frame

from vsep.errors import InputError


def spec_of(path):
    return changed(of_frame(path), {"max_iterations": 2})


def test_every_frame_gets_a_report_and_a_row(tmp_path, frame_arrays):
    for name in ("a", "b"):
        np.savez(tmp_path / f"{name}.npz", **frame_arrays())
    (tmp_path / "<bad>.npz").write_text("no frame")
    frames = [str(tmp_path / f"{name}.npz") for name in ("a", "<bad>", "b")]
    folder = tmp_path / "reports"
    errors = write_batch(frames, folder, spec_of=spec_of)
    assert len(errors) == 1
    assert "is not a frame file" in errors[0]
    assert sorted(path.name for path in folder.iterdir()) == ["a.html", "b.html", "index.html"]
    index = (folder / "index.html").read_text()
    assert index.count('<a href="') == 2
    assert index.count("data:image/png") == 2
    assert "2 of 3 frames" in index
    assert "<bad>" not in index
    assert read_provenance(folder / "a.html")["spec"]["plan"]["max_iterations"] == 2


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        (["a/x.npz", "b/x.npz"], "2 frames are named x"),
        (["index.npz", "x.npz"], "A frame is named index"),
        (["x.npz", "y.npz"], "is a file; several frames need a folder"),
    ],
)
def test_reports_never_overwrite_each_other(tmp_path, frames, words):
    folder = Path(__file__) if "folder" in words else tmp_path / "reports"
    with pytest.raises(InputError, match=words):
        write_batch(frames, folder, spec_of=spec_of)
    assert not (tmp_path / "reports").exists()
