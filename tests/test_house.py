"""The house rules that no tool checks: sizes, entries, what loads."""

import fnmatch
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from vsep_app import assets

import vsep

ROOT = Path(__file__).parents[1]
TOP_LEVEL = {
    ".ci",
    ".github",
    ".gitignore",
    "LICENSE",
    "Makefile",
    "README.md",
    "app",
    "assets",
    "pyproject.toml",
    "tests",
    "vsep",
}
MAX_LINES = 400
TEXT_SUFFIXES = {".py", ".md", ".toml", ".css", ".html", ".js", ".txt", ""}
# Home and scratch folders of one machine, spelled so that this file does not match itself.
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:work|farm|tmp|root|home)" + "/[a-z.]")


def own_files() -> list[str]:
    """Every file of the project, without what .gitignore names."""
    ignored = [".git", *(line.rstrip("/") for line in (ROOT / ".gitignore").read_text().split())]

    def is_ignored(name: str) -> bool:
        return any(fnmatch.fnmatch(name, pattern) for pattern in ignored)

    names = []
    for folder, folders, files in os.walk(ROOT):
        folders[:] = [name for name in folders if not is_ignored(name)]
        here = Path(folder).relative_to(ROOT)
        names += [str(here / name) for name in files if not is_ignored(name)]
    return names


def python_sources() -> Iterator[Path]:
    for package in ("vsep", "app/vsep_app"):
        yield from (ROOT / package).rglob("*.py")


def test_no_module_is_too_long_to_know() -> None:
    lengths = {str(path): len(path.read_text().splitlines()) for path in python_sources()}
    assert {path: length for path, length in lengths.items() if length > MAX_LINES} == {}


def test_the_top_level_holds_what_belongs_there() -> None:
    assert {Path(name).parts[0] for name in own_files()} <= TOP_LEVEL


def test_no_file_names_a_place_on_one_machine() -> None:
    texts = [ROOT / name for name in own_files() if Path(name).suffix in TEXT_SUFFIXES]
    found = [
        f"{path.name}: {match.group()}"
        for path in texts
        for match in MACHINE_PATH.finditer(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_the_page_fetches_nothing_from_outside() -> None:
    fetched = re.compile(r"https?://[^ )\"']*\.(?:js|css|woff2?)|fonts\.googleapis|cdn\.")
    for name in own_files():
        path = ROOT / name
        if path.suffix in {".py", ".css", ".html", ".js"} and "tests" not in path.parts:
            assert not fetched.search(path.read_text(encoding="utf-8")), name


def test_the_public_names_exist() -> None:
    assert [name for name in vsep.__all__ if not hasattr(vsep, name)] == []


def test_every_shipped_folder_is_in_the_wheel() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    included = project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    read = {
        match.group(1)
        for path in python_sources()
        if path.name != "assets.py"
        for match in re.finditer(r"\bpath\(\s*f?\"(\w+)/", path.read_text())
    }
    assert read
    assert {f"assets/{folder}" for folder in read} <= set(included)
    assert all(target.startswith("vsep_app/static/") for target in included.values())


def test_an_asset_that_is_not_shipped_is_named() -> None:
    with pytest.raises(FileNotFoundError, match=r"nothing\.npz"):
        assets.path("frames/nothing.npz")


def test_the_recording_ships_with_its_licence() -> None:
    folder = assets.path("frames/openradar_doppler_example_1.npz").parent
    notice = (folder / "NOTICE").read_text()
    assert "PreSenseRadar" in notice
    assert "openradar_doppler_example_1.npz" in notice
    assert "Version 2.0, January 2004" in (folder / "LICENSE-APACHE").read_text()


def test_the_command_does_linear_algebra_in_one_thread_unless_told_otherwise() -> None:
    code = (
        "import sys, vsep_app.cli.main\nassert 'numpy' not in sys.modules\n"
        "sys.argv = ['vsep', 'study', 'list']\n"
        "try:\n    vsep_app.cli.main.main()\nexcept SystemExit:\n    pass\n"
        "import os; assert 'numpy' in sys.modules; print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    free = {name: text for name, text in os.environ.items() if not name.endswith("_NUM_THREADS")}
    for given, wanted in (({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")):
        done = subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env={**free, **given},
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.split()[-1] == wanted


def test_help_loads_no_dashboard_and_no_plotting() -> None:
    heavy = ("panel", "bokeh", "holoviews", "matplotlib", "param", "pandas", "app", "scipy.signal")
    code = (
        "import sys\nfrom vsep_app.cli.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stderr.strip() == "[]"
