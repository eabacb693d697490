import json
import re
import subprocess
import sys

import numpy as np
import pytest
from vsep_app.report.metadata import read_provenance
from vsep_app.report.page import outcome, report_html
from vsep_app.report.run import execute, listed_settings, of_steps, provenance
from vsep_app.report.sources import of_report
from vsep_app.report.spec import ReportSpec
from vsep_app.report.write import report_bytes, write_report

from vsep.errors import InputError

SUFFIXES = (".html", ".png", ".pdf", ".json")
HEADS = {".html": b"<!DOCTYPE html>", ".png": b"\x89PNG\r\n\x1a\n", ".pdf": b"%PDF", ".json": b"{"}


def report_of(run, **changes):
    """The report's run of a finished run of the live view."""
    spec = ReportSpec(plan=run.prepared.plan, **changes)
    return of_steps(spec, run.steps[: changes.get("iteration")])


@pytest.fixture(scope="module")
def html(many_ramps):
    """The HTML report of Simulation II b."""
    return report_html(report_of(many_ramps, iterations=(1, 3)))


def test_the_html_asks_for_nothing(html):
    links = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)["']""", html)
    # The bundled script mentions addresses in strings; no tag of the page may point anywhere.
    body = re.sub(r"<script\b.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r"https?://", body)
    assert not [
        link for link in links if link.startswith(("http", "//")) and f'src="{link}"' in body
    ]
    assert "<link" not in body


def test_the_html_holds_views_film_table_settings_and_seed(html):
    for text in ("Fast time, ramp", "Delay spectrum", "bursts cancelled", "seed", "Iteration 3: "):
        assert text in html
    assert html.count('<tr class="found">') == 10
    assert "SNR 60.0 dB in total" in html
    assert html.count('class="figure"') == 8 + 2 * 3


def test_what_a_frame_is_called_cannot_become_markup(one_ramp):
    run = report_of(one_ramp)
    object.__setattr__(run.static_picture, "title", "<b>frame</b>")
    assert "<b>frame</b>" not in report_html(run)


def test_the_report_shows_what_the_screen_shows(many_ramps):
    picture = report_of(many_ramps).picture()
    last = many_ramps.steps[-1]
    assert picture.iteration == len(many_ramps.steps)
    assert np.array_equal(picture.objects.snr_db, 10.0 * np.log10(last.state.component_snr))
    assert picture.ramp == int(np.nanargmax(picture.burst_level_db))


def test_the_outcome_is_one_line(many_ramps, one_ramp):
    picture = report_of(many_ramps).picture()
    assert outcome(picture).endswith("10 objects, bursts in 4 of 16 ramps.")
    single = report_of(one_ramp).picture()
    assert outcome(single).endswith("1 object, bursts in 1 of 1 ramp.")


def test_the_settings_are_listed_for_a_reader(many_ramps):
    listed = listed_settings(report_of(many_ramps))
    assert listed["seed"] == "7"
    assert listed["SIR"] == "-20 dB"
    assert listed["schedule"] == "robust"
    assert listed["object threshold"].endswith(" dB")


def test_the_account_tells_what_was_found_and_what_it_is_worth(many_ramps):
    told = provenance(report_of(many_ramps))
    state = many_ramps.steps[-1].state
    assert [entry["beat"] for entry in told["result"]["objects"]] == state.objects.beats.tolist()
    assert (told["metrics"]["objects_true"], told["metrics"]["misses"]) == (10, 0)
    assert told["made_with"].keys() >= {"vsep", "numpy", "scipy", "bokeh", "matplotlib", "python"}
    assert "seconds" not in told["result"]


@pytest.mark.parametrize("changes", [{}, {"iteration": 2, "iterations": (0, 1), "ramp": 0}])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_report_is_made_again_from_what_it_says(one_ramp, tmp_path, suffix, changes):
    run, out = report_of(one_ramp, **changes), tmp_path / f"report{suffix}"
    write_report(run, out)
    assert out.read_bytes().startswith(HEADS[suffix])
    assert read_provenance(out) == json.loads(report_bytes(run, ".json"))
    spec = of_report(str(out))
    assert spec == run.spec
    assert report_bytes(execute(spec), suffix) == out.read_bytes()


def test_another_process_makes_the_same_page(many_ramps, tmp_path):
    # Here the drawing library has been used, and extended by the web page; there it is fresh.
    first, second = tmp_path / "first.html", tmp_path / "second.html"
    run = report_of(many_ramps, iteration=3)
    write_report(run, first)
    code = "import sys; from vsep_app.cli.main import main; sys.exit(main(sys.argv[1:]))"
    arguments = ["report", "--from", str(first), "--out", str(second)]
    subprocess.run([sys.executable, "-W", "error", "-c", code, *arguments], check=True, timeout=120)
    assert second.read_bytes() == first.read_bytes()
    # Measured 1.4 MB, nearly all of it the drawing library.
    assert len(first.read_bytes()) < 2_000_000


def test_a_document_has_the_film_strip_on_a_page_of_its_own(one_ramp):
    pages = [
        report_bytes(report_of(one_ramp, iterations=iterations), ".pdf").count(b"/Type /Page ")
        for iterations in ((), (1, 2))
    ]
    assert pages == [1, 2]


def test_a_picture_is_large_enough_for_print(many_ramps):
    content = report_bytes(report_of(many_ramps), ".png")
    width, height = (int.from_bytes(content[i : i + 4], "big") for i in (16, 20))
    assert width >= 1800
    assert height >= 1300


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"iteration": 400}, "has the iterations 0 to"),
        ({"iterations": (1, 400)}, "has the iterations 0 to"),
        ({"ramp": 3}, "has the ramps 0 to 0"),
        ({"mask": "amplitude"}, "factorised takes none; masked does"),
    ],
)
def test_what_the_run_does_not_have_is_refused(one_ramp, changes, words):
    with pytest.raises(InputError, match=words):
        execute(ReportSpec(plan=one_ramp.prepared.plan, **changes))


def test_another_suffix_is_one_sentence(one_ramp, tmp_path):
    with pytest.raises(InputError, match=r"must end in \.html, \.png, \.pdf or \.json"):
        write_report(report_of(one_ramp), tmp_path / "snapshot.svg")


def test_the_report_needs_no_panel_and_no_display():
    code = (
        "import sys; sys.modules['tkinter'] = None; "
        "import vsep_app.report.write, vsep_app.report.static_export, vsep_app.report.animation; "
        "loaded = {'panel', 'panel_material_ui', 'holoviews', 'matplotlib.pyplot'} "
        "& set(sys.modules); assert not loaded, loaded"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={"PATH": ""}, timeout=60)
