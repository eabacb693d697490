import os
import sys
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


@pytest.mark.skipif(sys.platform != "linux", reason="names are text on other systems")
def test_a_name_that_is_no_text_gets_a_report_and_a_link_by_its_bytes(tmp_path, frame_arrays):
    frame = tmp_path / os.fsdecode(b"night\xff.npz")
    with frame.open("wb") as file:
        np.savez(file, **frame_arrays())
    assert write_batch([str(frame)], tmp_path / "reports", spec_of=spec_of) == []
    index = (tmp_path / "reports" / "index.html").read_text()
    assert '<a href="night%FF.html">' in index
    assert "night\\udcff.npz</a>" in index
    report = tmp_path / "reports" / os.fsdecode(b"night\xff.html")
    assert read_provenance(report)["spec"]["frame"]["name"].endswith("night\\udcff.npz")


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
