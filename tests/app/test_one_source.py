"""A setting is stated once, in `vsep.parameters`; whoever uses it takes it from there."""

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from vsep_app.cli.main import parse
from vsep_app.model.settings import SETTINGS, Settings
from vsep_app.model.url import QUERY_NAMES, parse_query
from vsep_app.teaching.help import controls_html
from vsep_app.widgets.controls import Controls

from vsep.errors import InputError
from vsep.parameters import PARAMETERS
from vsep.presets.record import Preset
from vsep.separability.axes import AXES
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import INTERFERENCE_MODELS
from vsep.studies.axes import X_LABELS

ROOT = Path(__file__).parents[2]
HOME = ROOT / "vsep" / "parameters" / "__init__.py"
SOURCES = [*ROOT.glob("vsep/**/*.py"), *ROOT.glob("app/vsep_app/**/*.py")]
SIR = PARAMETERS["sir_db"]


@pytest.fixture
def controls():
    return Controls(Settings(), lambda *_: None)


def test_the_sir_is_that_of_its_record_wherever_it_is_used(controls):
    declared, slider = Settings.param["sir_db"], controls.widgets["sir_db"]
    assert declared.bounds == (slider.start, slider.end) == SIR.span
    assert declared.default == slider.value == SIR.default == Settings().sir_db
    assert declared.label == slider.label == "SIR [dB, total]"
    assert declared.doc == slider.description == SIR.help
    assert slider.step == SIR.step
    assert QUERY_NAMES["sir_db"] == SIR.query
    assert AXES["sir_db"] is SIR
    assert X_LABELS["sir_db"] == SIR.label == "SIR [dB]"
    assert Preset.__dataclass_fields__["sir_db"].default == SIR.default
    assert Scene.__dataclass_fields__["sir_db"].default == SIR.default
    assert SIR.help in controls_html(controls.layout()).replace("&#x27;", "'")
    command = ["simulate", "--preset", "simulation-1", "--out", "x.npz"]
    assert parse(command).sir_db is None


def test_a_scene_and_a_link_refuse_what_the_record_does():
    none = np.zeros(0)
    nothing = Channel(delays_s=none, dopplers_hz=none, weights=none)
    lowest, highest = SIR.bounds
    assert Scene(objects=nothing, snr_db=0.0, sir_db=highest).sir_db == highest
    sentence = f"SIR is {highest + 1:g} dB; it must lie between {lowest:g} and {highest:g} dB."
    with pytest.raises(InputError, match=sentence):
        Scene(objects=nothing, snr_db=0.0, sir_db=highest + 1)
    low, high = SIR.span
    assert parse_query({"sir": high + 1})[1] == [
        f"sir is {high + 1}; it must be a number between {low:g} and {high:g}."
    ]


def restatements(tree: ast.AST) -> Iterator[str]:
    """Yield what states bounds, label or default of the SIR."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Tuple):
            try:
                pair = ast.literal_eval(node)
            except ValueError:
                continue
            if pair in (SIR.bounds, SIR.span):
                yield f"bounds in line {node.lineno}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node.value.startswith(("SIR [", "Energy of all objects over the energy")):
                yield f"words in line {node.lineno}"
        elif (
            isinstance(node, ast.AnnAssign)
            and isinstance(node.value, ast.Constant | ast.UnaryOp)
            and ast.unparse(node.target) == "sir_db"
        ):
            yield f"default in line {node.lineno}"


def test_no_other_module_states_the_sir():
    trees = {path: ast.parse(path.read_text()) for path in SOURCES if path != HOME}
    assert len(trees) > 250
    assert {str(path): found for path in trees if (found := [*restatements(trees[path])])} == {}


def test_the_reader_sees_a_restatement():
    text = "sir_db: float = -20.0\nx = dict(bounds=(-50.0, 40.0), label='SIR [dB, total]')\n"
    assert len(list(restatements(ast.parse(text)))) == 3


@pytest.mark.parametrize("name", SETTINGS)
def test_every_setting_is_declared_as_its_record_says(name):
    record, declared = SETTINGS[name], Settings.param[name]
    assert (declared.default, declared.label, declared.doc) == (
        record.default,
        record.form_label,
        record.help,
    )
    if record.choices is None and not isinstance(record.default, bool | str):
        assert declared.bounds == record.offered
        if record.default is not None:
            assert record.offered[0] <= record.default <= record.offered[1]


def test_the_models_of_the_simulator_are_the_choices():
    assert tuple(PARAMETERS["interference_model"].choices) == INTERFERENCE_MODELS


def test_every_setting_of_a_run_has_a_widget(controls):
    assert set(controls.widgets) == {*PARAMETERS, "preset", "estimator", "placed"}
