import os
import subprocess

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image
from vsep_app.report.animation import LAST_MS, animation_palette, shown_iterations, write_animation
from vsep_app.report.metadata import read_provenance
from vsep_app.report.names import ffmpeg_program, require_animation_name
from vsep_app.report.run import provenance
from vsep_app.views.style import COLOURS

from tests.app.test_report import report_of
from vsep.errors import InputError


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_an_animation_shows_every_iteration_and_says_how_it_was_made(one_ramp, tmp_path, suffix):
    run, out = report_of(one_ramp, iteration=3), tmp_path / f"run{suffix}"
    write_animation(run, out)
    with Image.open(out) as image:
        # Pictures that are equal are stored as one that lasts longer.
        assert 2 <= image.n_frames <= 4
        image.seek(image.n_frames - 1)
        image.load()
        assert image.info["duration"] >= LAST_MS
    assert read_provenance(out)["spec"] == provenance(run)["spec"]


def test_lines_keep_their_colours():
    palette = animation_palette()
    assert palette.shape == (256, 3)
    for colour in COLOURS.values():
        distance = np.abs(palette - 255.0 * np.array(to_rgb(colour))).max(axis=1)
        assert distance.min() <= 0.5  # rounded to a byte


def test_a_long_run_is_shown_in_strides():
    assert shown_iterations(0) == [0]
    long = shown_iterations(299)
    assert (long[0], long[-1]) == (0, 299)
    assert len(long) <= 61


@pytest.mark.parametrize("name", ["run.avi", "run", "run.html"])
def test_another_suffix_is_one_sentence(name):
    with pytest.raises(InputError, match=r"must end in \.gif, \.webp or \.mp4"):
        require_animation_name(name)


def test_a_missing_ffmpeg_is_one_sentence(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("vsep_app.report.names.find_spec", lambda _: None)
    with pytest.raises(InputError, match="needs the program ffmpeg"):
        require_animation_name("run.mp4")


def test_the_video_is_stored_to_ffmpeg_and_its_failure_told(one_ramp, monkeypatch, tmp_path):
    tool = tmp_path / "ffmpeg"
    tool.write_text('#!/bin/sh\nfor last; do :; done\n/bin/cat > "$last"\n')
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    run, out = report_of(one_ramp, iteration=1), tmp_path / "run.mp4"
    write_animation(run, out)
    # 1 s of the first and 3 s of the last picture, ten a second, three bytes a pixel.
    assert out.stat().st_size == 40 * 960 * 560 * 3
    tool.write_text("#!/bin/sh\n/bin/cat > /dev/null\necho no such coder >&2\nexit 1\n")
    with pytest.raises(InputError, match="no such coder"):
        write_animation(run, out)


def test_ffmpeg_makes_a_video(one_ramp, tmp_path):
    out, program = tmp_path / "run.mp4", ffmpeg_program()
    assert program is not None
    write_animation(report_of(one_ramp, iteration=1), out)
    told = subprocess.run(
        [program, "-i", out, "-f", "null", os.devnull], capture_output=True, text=True, check=True
    )
    assert "960x560" in told.stderr
