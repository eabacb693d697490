"""Extensions of other distributions: one file each, then visible everywhere.

A temporary distribution declares what it adds by entry points; every test runs in a process that
finds it on its path, as after ``pip install``.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

METHOD = '''
"""Mitigation by halves: interfered samples are attenuated."""

from dataclasses import dataclass

from vsep import MitigationEntry, MitigationState, Termination


@dataclass(frozen=True, kw_only=True)
class Attenuation:
    """Interfered samples are attenuated by a factor."""

    name: str = "attenuation"
    factor: float = 0.5

    def init(self, received, mask):
        return MitigationState(iteration=0, cleaned=received)

    def step(self, received, mask, state):
        cleaned = received * (1.0 - (1.0 - self.factor) * mask).astype(received.real.dtype)
        cleaned.flags.writeable = False
        return MitigationState(iteration=1, cleaned=cleaned, change=0.0)

    def terminate(self, state):
        return Termination.CONVERGED if state.iteration else Termination.RUNNING


ENTRY = MitigationEntry(name="attenuation", label="Attenuation", factory=Attenuation)
'''
ESTIMATOR = '''
"""An estimator that looks twice."""

from dataclasses import dataclass

from vsep import ObjectOnlySeparator


@dataclass(frozen=True, kw_only=True)
class Patient(ObjectOnlySeparator):
    """Objects alone, at a third of the false-alarm rate."""

    false_alarm_rate: float = 0.05 / 3.0
'''
READER = '''
"""A kind of recordings: nothing but ones."""

import numpy as np

from vsep.recordings.readers import RecordingReader


def ones(path, key):
    return np.ones((4, 16), dtype=complex)


ENTRY = RecordingReader(name="ones", label="Ones (.one)", read=ones, suffixes=(".one",))
'''
FILES = {"vsep_attenuation": METHOD, "vsep_patient": ESTIMATOR, "vsep_ones": READER}
ENTRY_POINTS = """\
[vsep.mitigations]
attenuation = vsep_attenuation:ENTRY
broken = vsep_no_such_module:ENTRY

[vsep.readers]
ones = vsep_ones:ENTRY

[vsep.estimators]
patient = vsep_patient:Patient
"""
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Run Python where a distribution with these files is installed."""
    folder = tmp_path_factory.mktemp("site")
    for name, text in FILES.items():
        (folder / f"{name}.py").write_text(text)
    information = folder / "vsep_extension-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: vsep-extension\n")
    (information / "entry_points.txt").write_text(ENTRY_POINTS)
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])

    def python(*arguments: str, cwd: Path = folder) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )

    return python


@pytest.fixture(scope="module")
def seen(run: Run) -> dict[str, list[str]]:
    """Where names are listed, in one process."""
    script = """
import json
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS
from vsep.recordings.settings import FORMATS
from vsep.studies.methods import method_names
from vsep_app.model.compare_settings import method_entries
from vsep_app.pages.recording.form import _CHOICES
from vsep_app.teaching.help import methods_html

print(json.dumps({
    "estimators": list(ESTIMATORS),
    "mitigations": list(MITIGATIONS),
    "methods of studies": list(method_names()),
    "compare page": [entry.name for entry in method_entries()],
    "formats": list(FORMATS),
    "recording page": list(_CHOICES["format"][1].values()),
    "help": methods_html().replace("(", " ").replace(")", " ").split(),
}))
"""
    done = run("-c", script)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.mark.parametrize(
    ("name", "places"),
    [
        ("attenuation", ("mitigations", "methods of studies", "compare page", "help")),
        ("patient", ("estimators", "methods of studies", "compare page", "help")),
        ("ones", ("formats", "recording page")),
    ],
)
def test_it_is_listed(seen: dict[str, list[str]], name: str, places: tuple[str, ...]) -> None:
    assert [place for place in places if name not in seen[place]] == []


def test_ours_come_first_and_a_broken_one_is_left_out(seen: dict[str, list[str]]) -> None:
    assert (seen["estimators"][0], seen["estimators"][-1]) == ("factorised", "patient")
    assert (seen["mitigations"][0], seen["mitigations"][-1]) == ("zeroing", "attenuation")
    assert "broken" not in seen["mitigations"]


@pytest.mark.parametrize(
    ("command", "name"), [("mitigate", "attenuation"), ("separate", "patient")]
)
def test_the_help_of_the_command_line_names_it(run: Run, command: str, name: str) -> None:
    done = run("-m", "vsep", command, "--help")
    assert name in done.stdout.replace(",", " ").replace(":", " ").split()


@pytest.fixture(scope="module")
def frame(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("frames") / "frame.npz"
    arguments = ("--preset", "simulation-1", "--seed", "7", "--out", str(path))
    done = run("-m", "vsep", "simulate", *arguments)
    assert done.returncode == 0, done.stderr
    return path


def test_the_command_line_runs_it(run: Run, frame: Path) -> None:
    folder = frame.parent
    done = run(
        *("-m", "vsep", "mitigate", str(frame), "--method", "attenuation"),
        *("--out", str(folder / "cleaned")),
    )
    assert done.returncode == 0, done.stderr
    assert (folder / "cleaned" / frame.name).exists()
    out = folder / "results.jsonl"
    arguments = (str(frame), "--estimator", "patient", "--out", str(out))
    done = run("-m", "vsep", "separate", *arguments)
    assert done.returncode == 0, done.stderr
    assert json.loads(out.read_text())["termination"] == "converged"


def test_what_it_does_not_have_and_what_is_broken_is_said(run: Run, frame: Path) -> None:
    arguments = ("-m", "vsep", "mitigate", str(frame), "--out", str(frame.parent / "no"))
    done = run(*arguments, "--method", "attenuation", "--debias")
    assert done.returncode == 2
    assert done.stderr.startswith("vsep: --debias is given; attenuation takes none (ist,")
    done = run(*arguments, "--method", "broken")
    assert done.returncode == 2
    assert done.stderr == (
        "vsep: broken of vsep-extension (vsep.mitigations: vsep_no_such_module:ENTRY) cannot be "
        "loaded: ModuleNotFoundError: No module named 'vsep_no_such_module'.\n"
    )


def test_a_study_runs_it_on_worker_processes(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "rows.jsonl"
    methods = ("--estimator", "attenuation", "--estimator", "patient")
    where = ("--points", "15", "--realizations", "1", "--out", str(out), "--workers", "2")
    done = run("-m", "vsep", "study", "run", "fig-3", *methods, *where)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert {row["method"]: row["status"] for row in rows} == {
        "attenuation": "done",
        "patient": "done",
    }


def test_the_compare_page_runs_it(run: Run) -> None:
    script = """
from vsep_app.model.compare_settings import ComparePlan, parse_choice
from vsep_app.model.settings import Settings
from vsep_app.pages.compare.tasks import advance, prepare

choice, errors = parse_choice({"methods": "attenuation,patient"})
settings = Settings()
settings.choose_preset("simulation-1")
plan = ComparePlan(
    scene=settings.plan(),
    methods=tuple(choice["methods"]),
    mask="truth",
    debias=True,
    frame_number=0,
    histories={},
    past=(),
)
comparison = prepare(plan)
step = advance(comparison, comparison.initial_state)
print(errors, [view.name for view in step.views])
"""
    done = run("-c", script)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "[] ['attenuation', 'patient']\n"


def test_it_keeps_the_rules(run: Run) -> None:
    script = """
from vsep import check_estimator, check_mitigation
from vsep.inference.registry import ESTIMATORS
from vsep.mitigation.registry import MITIGATIONS
check_estimator(ESTIMATORS["patient"])
check_mitigation(MITIGATIONS["attenuation"])
"""
    done = run("-c", script)
    assert done.returncode == 0, done.stderr
