"""What the tests of the command line have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vsep_app.cli import main as cli


@pytest.fixture
def frame_file(tmp_path: Path, frame_arrays: Callable[..., dict[str, Any]]) -> Callable[..., str]:
    """Write a small frame and return its path as a text."""

    def write(name: str = "frame.npz", **changes: Any) -> str:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        np.savez(path, **frame_arrays(**changes))
        return str(path)

    return write


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command that must end with code 2, and return its one sentence."""

    def sentence(*arguments: str) -> str:
        try:
            code = cli.main(arguments)
        except SystemExit as stop:
            code = stop.code
        assert code == 2
        text = capsys.readouterr().err
        assert text.startswith("vsep: ")
        assert text.count("\n") == 1
        return text

    return sentence
