"""What ``pip install vsep`` alone can do, in a folder whose files bear names of ours."""

import ast
import json
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.app.cli.helpers import checkout_environment

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]
LIBRARY = {"numpy", "scipy", "numba"}
FOREIGN = ("app.py", "report.py")
# Import names, where they differ from those of the distributions.
IMPORT_NAMES = {"pillow": "PIL", "panel-material-ui": "panel_material_ui", "pyyaml": "yaml"}
# Pandas comes with Panel.
MISSING = {"panel", "panel_material_ui", "bokeh", "holoviews", "jinja2", "matplotlib", "pandas"}
MISSING |= {"param", "PIL", "tqdm", "yaml", "distributed", "imageio_ffmpeg"}
MISSING |= {"h5py", "rosbags", "sigmf"}

# Runs the command lines that it is given one after the other, in a Python without some libraries.
DRIVER = f"""\
import contextlib, io, json, sys
from importlib.machinery import PathFinder

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        missing = name.split(".")[0] in {MISSING!r}
        return None if missing else PathFinder.find_spec(name, path, target)

sys.meta_path[sys.meta_path.index(PathFinder)] = Finder
from vsep_app.cli.main import main

for line in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(line.split())
        except SystemExit as stop:
            code = stop.code
    print(json.dumps([line, code, out.getvalue(), err.getvalue()]))
"""
AXES = "--x sir_db=-40:0:3 --y slope_difference=-2e12:-5e11:2"
# In this order: the later ones read what the earlier ones have written.
WORKING = (
    "--version",
    "--help",
    "simulate --preset simulation-2-c --seed 7 --out frame.npz",
    "convert raw.npz --settings radar.json --out converted.npz",
    "separate frame.npz converted.npz --workers 1 --max-iterations 2 --out results.jsonl",
    "interferer-timing results.jsonl",
    "interferer-timing results.jsonl --out bursts.csv",
    "mitigate frame.npz --method zeroing --out cleaned",
    "calibrate frame.npz --out response.npz",
    "study list",
    "study run fig-2 --estimator object-only --out rows.jsonl",
    "study summary rows.jsonl --out summary.csv",
    f"separability {AXES} --out map.csv",
    "serve --help",
    "report --help",
    "study plot --help",
)
REFUSED = {
    "serve": "`vsep serve` needs the dashboard: pip install 'vsep[dashboard]'.",
    "report frame.npz --out a.html": "`vsep report` needs the dashboard: pip install "
    "'vsep[dashboard]'.",
    "report --preset simulation-1 --out a.json": "`vsep report` needs the dashboard: pip install "
    "'vsep[dashboard]'.",
    "study plot rows.jsonl --out a.png": "`vsep study plot` needs the dashboard: pip install "
    "'vsep[dashboard]'.",
    "interferer-timing results.jsonl --out a.png": "`vsep interferer-timing --out a.png` needs "
    "the dashboard: pip install 'vsep[dashboard]'.",
    f"separability {AXES} --trials 1000 --out a.html": "`vsep separability --out a.html` needs the "
    "dashboard: pip install 'vsep[dashboard]'.",
    "convert raw.npz --settings radar.yaml --out a.npz": "radar.yaml is YAML; it needs yaml: pip "
    "install 'vsep[yaml]'.",
    "convert adc.h5 --settings radar-hdf5.json --out a.npz": "adc.h5 is HDF5; it needs h5py: pip "
    "install 'vsep[hdf5]'.",
    "convert adc.bag --settings radar-raw.json --out a.npz": "adc.bag is a ROS bag; it needs "
    "rosbags: pip install 'vsep[ros]'.",
    "convert adc.sigmf-meta --settings radar-sigmf.json --out a.npz": "adc.sigmf-meta is SigMF; it "
    "needs sigmf: pip install 'vsep[sigmf]'.",
    "study run fig-2 --scheduler tcp://127.0.0.1:1 --out a.jsonl": "A scheduler needs distributed: "
    "pip install 'vsep[cluster]'.",
}
RADAR = {
    "format": "npz",
    "key": "x",
    "start_frequency_hz": 77e9,
    "slope_hz_per_s": 29e12,
    "sample_rate_hz": 20e6,
    "ramp_period_s": 30e-6,
}


class Outcome(NamedTuple):
    """What a command line came to."""

    code: int
    out: str
    err: str


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording, and with modules of names that were ours."""
    folder = tmp_path_factory.mktemp("foreign")
    for name in FOREIGN:
        (folder / name).write_text(f"raise RuntimeError('the foreign {name} was loaded')\n")
    noise = np.random.default_rng(1).standard_normal((2, 8, 64))
    np.savez(folder / "raw.npz", x=noise[0] + 1j * noise[1])
    for suffix in ("json", "yaml"):
        (folder / f"radar.{suffix}").write_text(json.dumps(RADAR))
    (folder / "adc.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(1000))
    (folder / "adc.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(1000))
    for name, kind in (("hdf5", "hdf5"), ("raw", "dca1000-xwr16xx"), ("sigmf", "sigmf")):
        said = RADAR | {"format": kind, "key": None, "num_samples": 64}
        (folder / f"radar-{name}.json").write_text(json.dumps(said))
    return folder


@pytest.fixture(scope="module")
def outcomes(folder: Path) -> dict[str, Outcome]:
    """Run all command lines in that folder, without the libraries of any extra."""
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, json.dumps([*WORKING, *REFUSED])],
        cwd=folder,
        env=checkout_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {line: Outcome(*rest) for line, *rest in map(json.loads, done.stdout.splitlines())}


@pytest.mark.parametrize("line", WORKING)
def test_the_library_alone_runs_whatever_draws_nothing(
    outcomes: dict[str, Outcome], folder: Path, line: str
) -> None:
    assert outcomes[line].code == 0, outcomes[line].err
    assert "vsep[" not in outcomes[line].err
    _, named, out = line.partition(" --out ")
    assert (folder / out).exists() if named else outcomes[line].out


@pytest.mark.parametrize("line", REFUSED)
def test_for_the_rest_one_sentence_says_what_to_install(
    outcomes: dict[str, Outcome], folder: Path, line: str
) -> None:
    assert outcomes[line] == Outcome(2, "", f"vsep: {REFUSED[line]}\n")
    out = folder / line.rpartition(" ")[2]
    assert not out.exists() or not out.read_bytes()


def test_python_m_vsep_works_in_that_folder(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "vsep", "study", "list"],
        cwd=folder,
        env=checkout_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("fig-1 ")


def name_of(requirement: str) -> str:
    """Return the name of a distribution from its requirement."""
    match = re.match(r"[\w-]+", requirement)
    assert match is not None
    return match.group()


def test_the_library_depends_on_numpy_scipy_and_numba_alone() -> None:
    assert {name_of(requirement) for requirement in PROJECT["dependencies"]} == LIBRARY
    for extra, requirements in EXTRAS.items():
        assert not LIBRARY & {name_of(requirement) for requirement in requirements}, extra


def test_the_extra_of_the_developers_contains_what_users_may_add() -> None:
    (own,) = (each for each in EXTRAS["dev"] if name_of(each) == "vsep")
    assert set(own.removeprefix("vsep[").removesuffix("]").split(",")) == (
        {"cluster", "dashboard", "hdf5", "ros", "sigmf", "video", "xarray", "yaml"}
    )


def test_whatever_the_application_loads_is_in_its_extra() -> None:
    names = {name_of(requirement) for requirement in EXTRAS["dashboard"]}
    known = {IMPORT_NAMES.get(name, name) for name in names} | LIBRARY | {"vsep", "vsep_app"}
    known |= sys.stdlib_module_names
    loaded = set()
    for path in (ROOT / "app" / "vsep_app").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                loaded |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                loaded.add(node.module.split(".")[0])
    assert "panel" in loaded
    # Tornado is the web server of Bokeh, pandas the table of Panel.
    assert loaded - known <= {"tornado", "pandas"}


def test_the_script_is_the_command_line() -> None:
    module, _, function = PROJECT["scripts"]["vsep"].partition(":")
    assert callable(getattr(import_module(module), function))
