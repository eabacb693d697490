"""The command itself: help, exit codes, what is loaded."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from vsep_app import assets
from vsep_app.cli import main as cli

import vsep
from tests.app.cli.helpers import COMMAND, start_process
from tests.app.cli.test_convert import OPENRADAR
from vsep.files.results import as_json
from vsep.studies.trial import Row

FrameArrays = Callable[..., dict[str, Any]]
Refused = Callable[..., str]


def test_version_and_help_are_given(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--version"])
    assert capsys.readouterr().out == f"vsep {vsep.__version__}\n"
    for command in ("serve", "simulate", "separate", "report"):
        with pytest.raises(SystemExit, match="0"):
            cli.main([command, "--help"])
        assert "example" in capsys.readouterr().out


# The libraries of all commands are loaded once; each command line is then given in a fork.
LOADED = """\
import contextlib, importlib, io, json, os, sys
from vsep_app.cli.main import main

def given(words):
    read, write = os.pipe()
    if os.fork() == 0:
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
            main(words)
        with open(write, "w") as pipe:
            json.dump([said.getvalue(), *sys.modules], pipe)
        os._exit(0)
    os.close(write)
    with open(read) as pipe:
        return json.load(pipe)

lines, libraries = json.loads(sys.argv[1])
told = [given(lines[0]), given(lines[1])]
for library in libraries:
    importlib.import_module(library)
print(json.dumps(told + [given(words) for words in lines[2:]]))
"""
LINES = [["--help"], ["--version"], *([command, "--help"] for command in cli.COMMANDS)]
NUMBERS = ("numpy", "scipy.fft", "scipy.linalg", "scipy.ndimage", "scipy.optimize", "scipy.signal")


@pytest.fixture(scope="module")
def loaded() -> dict[str, set[str]]:
    """The modules that each command line loads."""
    process = start_process(LOADED, json.dumps([LINES, NUMBERS]))
    told, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    modules = {}
    for words, (said, *names) in zip(LINES, json.loads(told), strict=True):
        assert "usage: vsep" in said or said.startswith("vsep ")
        modules[words[0]] = set(names)
    return modules


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_and_version_load_no_command_and_no_numbers(
    loaded: dict[str, set[str]], option: str
) -> None:
    heavy = {"numpy", "scipy", "numba"}
    assert not loaded[option] & (heavy | {module for module, _ in cli.COMMANDS.values()})


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_of_a_command_loads_it_alone_and_nothing_that_draws(
    loaded: dict[str, set[str]], command: str
) -> None:
    modules = {module for module, _ in cli.COMMANDS.values()}
    assert loaded[command] & modules == {cli.COMMANDS[command][0]}
    drawing = {"panel", "bokeh", "holoviews", "matplotlib", "param", "pandas", "PIL"}
    assert not loaded[command] & (drawing | {"numba"})


def test_every_command_is_in_the_help_with_its_summary(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="0"):
        cli.main(["--help"])
    said = "".join(capsys.readouterr().out.split())
    for name, (_, summary) in cli.COMMANDS.items():
        assert name + "".join(summary.split()) in said


def test_no_command_is_an_error(refused: Refused) -> None:
    assert "COMMAND" in refused()
    assert "invalid choice: 'sing'" in refused("sing")


def test_a_process_ends_with_the_code_and_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "frame.npz").write_text("no frame")
    process = start_process(
        COMMAND, "separate", "frame.npz", "--out", "results.jsonl", cwd=tmp_path
    )
    _, errors = process.communicate(timeout=60)
    assert errors.startswith("vsep: frame.npz is not a frame file")
    assert "Traceback" not in errors
    assert process.returncode == 2


def test_commands_that_need_no_kernel_load_none_and_need_no_home(
    tmp_path: Path, study_rows: list[Row], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rows.jsonl").write_text("".join(as_json(row) + "\n" for row in study_rows))
    (tmp_path / "radar.json").write_text(json.dumps(OPENRADAR | {"key": "received"}))
    shipped = str(assets.path("frames/openradar_doppler_example_1.npz"))
    for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.setenv(name, str(tmp_path / "rows.jsonl" / "nowhere"))
    commands = [
        ["convert", shipped, "--settings", "radar.json", "--out", "frame.npz"],
        ["study", "summary", "rows.jsonl", "--out", "summary.csv"],
        ["study", "list"],
    ]
    code = (
        "import sys\nfrom vsep_app.cli.main import main\n"
        f"print([main(each) for each in {commands}], 'numba' in sys.modules, file=sys.stderr)"
    )
    process = start_process(code, cwd=tmp_path)
    _, said = process.communicate(timeout=60)
    *remarks, last = said.strip().splitlines()
    assert last == "[0, 0, 0] False"
    assert all(remark.startswith("vsep: An object at") for remark in remarks)  # that migrates


def test_a_reader_that_leaves_early_causes_no_traceback() -> None:
    code = (
        "import sys\nfrom vsep_app.cli import main as cli, serve\n"
        "def speak(options):\n"
        "    sys.stdout.write('x' * 1_000_000)\n    return 0\n"
        "serve.run = speak\nsys.exit(cli.main(['serve']))"
    )
    process = start_process(code)
    assert process.stdout is not None
    process.stdout.close()
    assert process.stderr is not None
    errors = process.stderr.read()
    process.stderr.close()
    assert process.wait(60) == 141
    assert errors == ""
