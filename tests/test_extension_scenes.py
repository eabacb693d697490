"""A preset with its own radar and a study with its figure, one file each, from another package.

And a slider by one entry. Each is tried in a process of its own: entry points and records are read
when modules are loaded.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PRESET = """
from vsep.presets.channels import direct_path, many_objects
from vsep.presets.record import SimulatedPreset
from vsep.signal.radar import ChirpSequence, InterfererSequence

PRESET = SimulatedPreset(
    name="near",
    label="Near range: four objects",
    help="Four objects, eight ramps of a 77 GHz radar.",
    radar=ChirpSequence(
        start_frequency_hz=77e9, slope_hz_per_s=2e13, sample_rate_hz=4e6,
        ramp_period_s=30e-6, num_samples=64, num_ramps=8,
    ),
    interferer=InterfererSequence(
        start_frequency_hz=77.01e9, slope_hz_per_s=1.9e13,
        ramp_duration_s=30e-6, ramp_period_s=60e-6, num_ramps=4,
    ),
    draw_objects=lambda rng, count: many_objects(rng, 4 if count is None else count),
    draw_paths=direct_path,
    num_objects=4,
    snr_db=45.0,
    sir_db=-12.0,
    slope_range_hz_per_s=(1.5e13, 2.5e13),
    cutoff_range_hz=(0.2e6, 2e6),
    shift_range_s=(-5e-6, 5e-6),
)
"""
STUDY = """
from vsep.studies.panel_specs import PanelSpec
from vsep.studies.study import Point, Study

STUDY = Study(
    name="near-levels",
    title="Near range over SIR",
    points=tuple(
        Point(panel="near", scene="near", snr_db=45.0, sir_db=sir_db) for sir_db in (-20.0, 0.0)
    ),
    realizations=2,
    methods=("object-only", "no-interference"),
    panels=(
        PanelSpec(
            panel="near", metric="misses", x="sir_db", y_label="misses a frame", title="Near range"
        ),
    ),
)
"""
ENTRY_POINTS = """
[vsep.presets]
near = near_preset:PRESET
broken = no_such_module:PRESET
[vsep.studies]
near-levels = near_study:STUDY
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an installed distribution of two modules."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "near_preset.py").write_text(PRESET)
    (folder / "near_study.py").write_text(STUDY)
    info = folder / "near-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: near\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder


def run(script: str, folder: Path, *paths: Path) -> str:
    """Run a script with further folders on the path of modules; return what it printed."""
    path = os.pathsep.join(map(str, [*paths, *filter(None, sys.path)]))
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_preset_of_one_file_is_everywhere(package: Path, tmp_path: Path) -> None:
    script = """
from vsep_app.cli.main import main, parse
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.settings import Settings
from vsep_app.model.url import parse_query
from vsep_app.pages.separability.form import SeparabilityForm
from vsep_app.pages.separability.url import read_map_spec
from vsep_app.teaching.help import scenes_html
from vsep_app.widgets.controls import Controls

import vsep
from vsep.separability.analytic import analytic_map

assert main(["simulate", "--preset", "near", "--seed", "3", "--out", "near.npz"]) == 0
frame = vsep.read_frame("near.npz")
assert frame.received.shape == (8, 64) and frame.radar.slope_hz_per_s == 2e13
assert frame.settings["snr_db"] == "45.0" and frame.settings["sir_db"] == "-12.0"
parse(["report", "--preset", "near", "--out", "x.html"])
parse(
    ["separability", "--scene", "near", "--x", "a", "--y", "b", "--out", "x.csv"]
)

settings = Settings()
controls = Controls(settings, lambda *_: None)
assert controls.widgets["preset"].options["Near range: four objects"] == "near"
controls.widgets["preset"].value = "near"
assert (settings.snr_db, settings.sir_db, settings.interferer_slope) == (45.0, -12.0, 19.0)
slope = controls.widgets["interferer_slope"]
assert (slope.start, slope.end) == (15.0, 25.0)
made = make_scene(settings.plan()).frame
assert made.received.shape == (8, 64) and len(made.truth.beats) == 4
assert parse_query({"preset": "near", "slope": "9"})[1] == [
    "slope is 9; it must be a number between 15 and 25."
]
assert "Four objects, eight ramps" in scenes_html()

spec, _, errors = read_map_spec(
    {"scene": "near", "x": "sir_db=-20:0:2", "y": "slope_difference=-2e12:-1e12:2"}
)
assert errors == [] and spec.point((0, 0)).snr_db == 45.0
assert analytic_map(spec).whole_db.shape == (2, 2)
assert "near" in SeparabilityForm(spec, lambda: None).scene.options.values()
try:
    vsep.simulate_preset("broken", snr_db=0.0, sir_db=0.0, seed=0)
except vsep.InputError as error:
    print(error)
"""
    sentence = run(script, tmp_path, package)
    assert sentence.startswith("broken of near (vsep.presets: no_such_module:PRESET) cannot be")


def test_a_study_of_one_file_is_listed_run_drawn_and_summed_up(
    package: Path, tmp_path: Path
) -> None:
    script = """
from pathlib import Path

from vsep_app.cli.main import main
from vsep_app.pages.studies.form import StudyForm
from vsep_app.pages.studies.scatter import ScatterChoice
from vsep_app.teaching.help import scenes_html

from vsep.studies.figures import study_panels
from vsep.studies.rows import read_rows

assert main(["study", "list"]) == 0
assert main(["study", "run", "near-levels", "--out", "rows.jsonl"]) == 0
assert main(["study", "plot", "rows.jsonl", "--out", "figure.html"]) == 0
assert main(["study", "plot", "rows.jsonl", "--out", "figure.png"]) == 0
assert main(["study", "summary", "rows.jsonl", "--out", "table.csv"]) == 0
rows = read_rows("rows.jsonl")
assert len(rows) == 2 * 2 * 2
(panel,) = study_panels(rows)
assert panel.title == "Near range" and len(panel.series) == 2
assert "Near range" in Path("figure.html").read_text(encoding="utf-8")
assert "near-levels" in Path("table.csv").read_text(encoding="utf-8")

form = StudyForm(lambda *_: None, own_folder=False)
assert "near-levels" in form.study_name.options
form.study_name.value = "near-levels"
assert form.panels.options == ["near"]
assert ScatterChoice(study="near-levels", panel="near", value="misses").x == "sir_db"
assert "Near range over SIR" in scenes_html()
"""
    listed = run(script, tmp_path, package)
    assert "near-levels   Near range over SIR" in listed


def test_a_study_is_handed_over_as_an_object(tmp_path: Path) -> None:
    (tmp_path / "near_preset.py").write_text(PRESET)
    script = """
from dataclasses import replace

import vsep
from near_preset import PRESET
from vsep.studies.catalogue import make_study
from vsep.studies.engine import record_study
from vsep.studies.figures import study_panels

_, observation = vsep.simulate_preset(PRESET, snr_db=30.0, sir_db=-20.0, seed=1)
assert observation.received.shape == (8, 64)
own = replace(make_study("fig-5"), name="mine", methods=("object-only",))
own = make_study(own, realizations=1, selection="5d-f")
assert own.name == "mine" and len(own.point_indices) == 17
own = replace(own, selected=own.point_indices[:2])
rows = [row for rows in record_study(own, "rows.jsonl", workers=2) for row in rows]
assert len(rows) == 2
titles = {panel.title for panel in study_panels(rows, own)}
assert "Fig. 5d-f: over SIR at SNR 60 dB, the paper's methods" in titles, titles
assert study_panels(rows) == []
"""
    run(f"if __name__ == '__main__':\n{_indented(script)}", tmp_path, tmp_path)


def test_a_slider_is_one_entry(tmp_path: Path) -> None:
    script = """
from vsep import parameters

entry = parameters.Parameter(
    name="object_delay",
    title="Object delay",
    help="Delay of the first object.",
    default=80.0,
    unit="ns",
    scale=1e-9,
    bounds=(-200.0, 200.0),
    span=(0.0, 120.0),
    query="delay",
    option="object_delay_s",
    of_recording=False,
)
parameters.SCENE_PARAMETERS += (entry,)
parameters.PARAMETERS["object_delay"] = entry

from vsep_app.cli import main as cli
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.settings import Settings
from vsep_app.model.url import parse_query
from vsep_app.teaching.help import controls_html
from vsep_app.widgets.controls import Controls

settings = Settings()
controls = Controls(settings, lambda *_: None)
slider = controls.widgets["object_delay"]
shown = slider.start, slider.end, slider.value, slider.label
assert shown == (0.0, 120.0, 80.0, "Object delay [ns]")
assert slider in controls.scene() and entry.help in controls_html(controls.folded())
slider._process_events({"value": 51.0, "value_throttled": 51.0})
assert settings.object_delay == 51.0
frame = make_scene(settings.plan()).frame
assert abs(frame.truth.beats[0] - frame.radar.beat_from_delay(51e-9)) < 1e-12
assert parse_query({"delay": "7"})[0] == {"object_delay": 7.0}
assert parse_query({"delay": "500"})[1] == [
    "delay is 500; it must be a number between 0 and 120."
]
options = cli.parse(["simulate", "--preset", "simulation-1", "--object-delay", "51", "--out", "x"])
assert options.object_delay == 51.0
settings.choose_preset("real-frame")
assert slider.disabled
make_scene(settings.plan())
"""
    run(script, tmp_path)


def _indented(script: str) -> str:
    return "\n".join("    " + line for line in script.splitlines())
