import re
import subprocess
import sys

import numpy as np
import pytest

from app.report import final_picture, outcome, report_html, write_report
from vsep._arrays import InputError
from vsep.files.frame import Frame

SETTINGS = {"preset": "simulation-2-b", "seed": "7", "schedule": "<robust>"}
PNG_HEAD = b"\x89PNG\r\n\x1a\n"


def _frame(run, **changes):
    prepared = run.prepared
    known = {
        "received": prepared.observation.received,
        "radar": prepared.backdrop.radar,
        "truth": prepared.observation.truth,
        "name": "scene.npz",
    }
    return Frame(**(known | changes))


@pytest.fixture(scope="module")
def html(many_ramps):
    """The HTML report of Simulation II b."""
    picture = final_picture(_frame(many_ramps), many_ramps.prepared.estimator)
    return report_html(picture, settings=SETTINGS)


def test_the_html_asks_for_nothing(html):
    links = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)["']""", html)
    # The bundled script mentions addresses in strings; no tag of the page may point anywhere.
    body = re.sub(r"<script\b.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r"https?://", body)
    assert not [
        link for link in links if link.startswith(("http", "//")) and f'src="{link}"' in body
    ]
    assert "<link" not in body


def test_the_html_holds_views_table_settings_and_seed(html):
    for text in ("Fast time, ramp", "Delay spectrum", "bursts cancelled", "seed", "scene.npz"):
        assert text in html
    assert html.count('<tr class="found">') == 10
    assert "&lt;robust&gt;" in html
    assert "SNR 60.0 dB in all" in html


def test_the_report_shows_what_the_screen_shows(many_ramps):
    picture = final_picture(_frame(many_ramps), many_ramps.prepared.estimator)
    last = many_ramps.steps[-1]
    assert picture.iteration == len(many_ramps.steps)
    assert np.array_equal(picture.objects.snr_db, 10.0 * np.log10(last.state.objects.component_snr))


def test_the_ramp_with_the_strongest_burst_is_shown(many_ramps):
    picture = final_picture(_frame(many_ramps), many_ramps.prepared.estimator)
    assert picture.ramp == int(np.nanargmax(picture.burst_level_db))


def test_the_outcome_is_one_line(many_ramps, one_ramp):
    picture = final_picture(_frame(many_ramps), many_ramps.prepared.estimator)
    assert outcome(picture).endswith("10 objects, bursts in 4 of 16 ramps.")
    single = final_picture(_frame(one_ramp), one_ramp.prepared.estimator)
    assert outcome(single).endswith("1 object, bursts in 1 of 1 ramp.")


@pytest.mark.parametrize("run", ["one_ramp", "many_ramps"])
@pytest.mark.parametrize("suffix", [".png", ".html", ".HTML"])
@pytest.mark.parametrize("with_truth", [True, False])
def test_reports_are_written(run, suffix, with_truth, request, tmp_path):
    run = request.getfixturevalue(run)
    frame = _frame(run) if with_truth else _frame(run, truth=None)
    out = tmp_path / f"snapshot{suffix}"
    write_report(frame, out, separator=run.prepared.estimator, settings=SETTINGS)
    content = out.read_bytes()
    if suffix == ".png":
        assert content.startswith(PNG_HEAD)
        width, height = (int.from_bytes(content[i : i + 4], "big") for i in (16, 20))
        assert width >= 1800
        assert height >= 1300
    else:
        assert content.lstrip().lower().startswith(b"<!doctype html>")
        # Measured 1.4 MB, nearly all of it the drawing library.
        assert len(content) < 2_000_000


def test_another_suffix_is_one_sentence(one_ramp, tmp_path):
    with pytest.raises(InputError, match=r"must end in \.html or \.png"):
        write_report(
            _frame(one_ramp),
            tmp_path / "snapshot.pdf",
            separator=one_ramp.prepared.estimator,
            settings={},
        )


def test_the_report_needs_no_panel_and_no_display():
    code = (
        "import sys; sys.modules['tkinter'] = None; import app.report; "
        "loaded = {'panel', 'panel_material_ui', 'holoviews', 'matplotlib.pyplot'} "
        "& set(sys.modules); assert not loaded, loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={"PATH": ""}, timeout=60)
