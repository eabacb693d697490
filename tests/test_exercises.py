"""The exercises: their cells run, check the answer, and do not pass without one."""

import ast
import contextlib
import io
import json
import sys
import types
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "assets" / "exercises"
EXERCISES = sorted(FOLDER.glob("*.ipynb"))


def cells(path):
    """The code cells of a notebook: text, and whether it is a solution."""
    book = json.loads(path.read_text(encoding="utf-8"))
    for cell in book["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            yield "".join(cell["source"]), "solution" in cell["metadata"].get("tags", [])


def run(path, *, solved):
    """Execute a notebook as Python, in one namespace."""
    module = types.ModuleType("__exercise__")
    # What a notebook defines can be pickled: it stands in a module.
    sys.modules[module.__name__] = module
    try:
        with contextlib.redirect_stdout(io.StringIO()) as told:
            for text, is_solution in cells(path):
                if solved or not is_solution:
                    exec(compile(text, path.name, "exec"), module.__dict__)
    finally:
        del sys.modules[module.__name__]
    return told.getvalue()


def test_there_are_six():
    assert len(EXERCISES) == 6


@pytest.mark.parametrize("path", EXERCISES, ids=lambda path: path.stem)
def test_an_exercise_runs_and_says_that_the_answer_is_right(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "right" in run(path, solved=True)


@pytest.mark.parametrize("path", EXERCISES, ids=lambda path: path.stem)
def test_without_an_answer_the_first_check_fails(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(NameError):
        run(path, solved=False)


@pytest.mark.parametrize("path", EXERCISES, ids=lambda path: path.stem)
def test_an_exercise_uses_no_application_and_nothing_private(path):
    for text, _ in cells(path):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom | ast.Import):
                module = getattr(node, "module", None) or node.names[0].name
                assert module.split(".")[0] in ("numpy", "vsep", "dataclasses")
                assert "._" not in module
