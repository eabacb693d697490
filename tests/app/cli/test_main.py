"""The command itself: help, exit codes, what is loaded."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from vsep_app.cli import main as cli

import vsep
from tests.app.cli.helpers import COMMAND, start_process

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


def loaded_by(*arguments: str) -> set[str]:
    """Return the modules that a command line loads."""
    code = (
        "import sys\nfrom vsep_app.cli.main import main\n"
        f"try:\n    main({list(arguments)!r})\nexcept SystemExit:\n    pass\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    process = start_process(code)
    said, modules = process.communicate(timeout=60)
    assert process.returncode == 0
    assert "usage: vsep" in said or said.startswith("vsep ")
    return set(modules.split())


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_help_and_version_load_no_command_and_no_numbers(option: str) -> None:
    heavy = {"numpy", "scipy", "numba"}
    assert not loaded_by(option) & (heavy | {module for module, _ in cli.COMMANDS.values()})


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_help_of_a_command_loads_it_alone_and_nothing_that_draws(command: str) -> None:
    loaded = loaded_by(command, "--help")
    modules = {module for module, _ in cli.COMMANDS.values()}
    assert loaded & modules == {cli.COMMANDS[command][0]}
    assert not loaded & {"panel", "bokeh", "holoviews", "matplotlib", "param", "pandas", "PIL"}


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
