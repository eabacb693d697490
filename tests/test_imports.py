"""Who may import whom: the floors of the package, read from the source without running it."""

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted([*ROOT.glob("vsep/**/*.py"), *ROOT.glob("app/**/*.py")])

# Lower floors know nothing of higher ones; rooms of the same height only of themselves.
FLOORS = {
    "vsep._arrays": 0,
    "vsep._version": 0,
    "vsep.workers": 0,
    "vsep.kernels": 1,
    "vsep.signal": 2,
    "vsep.inference": 3,
    "vsep.analysis": 3,
    # A detector of interfered samples fits objects.
    "vsep.mitigation": 4,
    # Objects under a burst are filled in by a method of mitigation.
    "vsep.calibration": 5,
    "vsep.files": 5,
    # The rows of a study are written as result lines are.
    "vsep.studies": 6,
    "vsep.recordings": 6,
    # The laboratory's trials are those of the studies.
    "vsep.laboratory": 7,
    "vsep": 7,
    "vsep.second_pass": 7,
    "vsep.first_use": 8,
    "vsep.iteration_bar": 7,
    "vsep.commands": 8,
    "vsep.calibrate_commands": 8,
    "vsep.convert_commands": 8,
    "vsep.lattice_commands": 8,
    "vsep.mitigate_commands": 8,
    "vsep.report_commands": 8,
    "vsep.simulate_commands": 8,
    "vsep.study_commands": 8,
    "vsep.convert_options": 9,
    "vsep.lattice_options": 9,
    "vsep.simulate_options": 9,
    "vsep.separability_commands": 8,
    "vsep.mitigate_options": 9,
    "vsep.calibrate_options": 9,
    "vsep.report_options": 10,
    "vsep.study_options": 9,
    "vsep.separability_options": 9,
    "vsep.cli": 11,
    "vsep.__main__": 12,
}
COMMAND_LINE = (
    "vsep.commands",
    "vsep.iteration_bar",
    "vsep.calibrate_commands",
    "vsep.lattice_commands",
    "vsep.mitigate_commands",
    "vsep.report_commands",
    "vsep.study_commands",
    "vsep.separability_commands",
    "vsep.cli",
)
DRAWING = {"panel", "panel_material_ui", "bokeh", "holoviews"}
# `vsep` beside the standard library; the command line also draws a progress bar and calls the app.
LIBRARIES = {"numpy", "scipy", "vsep"}
COMPILER = {
    "vsep.kernels.compiler": {"numba"},
    "vsep.kernels.code_cache": {"llvmlite", "numba"},
}
# Optional libraries, imported inside the function that needs them. Dask's own scheduler and workers
# run a study on several machines, which is better not written twice (`pip install vsep[cluster]`);
# PyYAML reads settings files and comes with Bokeh.
OPTIONAL = {"vsep.studies.cluster": {"distributed"}, "vsep.recordings.settings": {"yaml"}}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in SOURCES}


def imports_of(tree: ast.AST) -> Iterator[str]:
    """Yield every imported module in full; `from a import b` yields a.b where that is a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import in line {node.lineno}"
            assert node.module is not None
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in MODULES else node.module for name in names)


def imports_at_load(tree: ast.Module) -> set[str]:
    """Imports outside of functions: those that run when the module is loaded."""
    inside = [
        node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    return set(imports_of(tree)) - {name for node in inside for name in imports_of(node)}


IMPORTS = {name: set(imports_of(ast.parse(path.read_text()))) for name, path in MODULES.items()}


def room(module: str) -> str:
    """The entry of `FLOORS` that a module of vsep belongs to."""
    prefix = ".".join(module.split(".")[:2])
    return prefix if prefix in FLOORS else module


def in_package(package: str) -> list[str]:
    return [name for name in MODULES if name == package or name.startswith(f"{package}.")]


@pytest.mark.parametrize("module", in_package("vsep"))
def test_vsep_needs_only_numpy_scipy_and_in_one_place_a_compiler(module: str) -> None:
    allowed = LIBRARIES | sys.stdlib_module_names
    if module in COMMAND_LINE:
        allowed = allowed | {"tqdm", "app"}
    allowed = allowed | OPTIONAL.get(module, set()) | COMPILER.get(module, set())
    assert {name.split(".")[0] for name in IMPORTS[module]} <= allowed


@pytest.mark.parametrize("module", OPTIONAL)
def test_optional_libraries_are_imported_inside_functions(module: str) -> None:
    tree = ast.parse(MODULES[module].read_text())
    # What only a type checker reads is not imported when the module is loaded.
    typing = [node for node in tree.body if isinstance(node, ast.If)]
    tree.body = [node for node in tree.body if node not in typing]
    loaded = {name.split(".")[0] for name in imports_at_load(tree)}
    assert not loaded & OPTIONAL[module]


@pytest.mark.parametrize("module", in_package("vsep"))
def test_floors_only_look_down(module: str) -> None:
    own = room(module)
    assert own in FLOORS, f"{module} belongs to no floor"
    for imported in IMPORTS[module]:
        if imported.split(".")[0] == "vsep" and room(imported) != own:
            assert FLOORS[room(imported)] < FLOORS[own], imported


def test_only_functions_of_the_command_line_call_the_app() -> None:
    for module in COMMAND_LINE:
        loaded = imports_at_load(ast.parse(MODULES[module].read_text()))
        assert not {name for name in loaded if name.split(".")[0] == "app"}


@pytest.mark.parametrize("module", [*in_package("vsep.inference"), *in_package("vsep.mitigation")])
def test_no_estimator_can_see_the_truth(module: str) -> None:
    hidden = {"vsep.signal.simulate", "vsep.signal.presets", "vsep.signal.scene"}
    hidden |= {"vsep.signal.bursts"}
    assert not IMPORTS[module] & hidden


@pytest.mark.parametrize("module", ["app.settings", "app.session", "app.picture"])
def test_the_model_of_the_dashboard_draws_nothing(module: str) -> None:
    assert not {name.split(".")[0] for name in IMPORTS[module]} & DRAWING


@pytest.mark.parametrize("module", in_package("app.views"))
def test_views_draw_pictures_and_compute_nothing(module: str) -> None:
    assert not [name for name in IMPORTS[module] if name.split(".")[0] == "vsep"]


def test_a_report_needs_no_web_page() -> None:
    reached = set()
    waiting = ["app.report.write", "app.report.batch", "app.report.animation"]
    while waiting:
        module = waiting.pop()
        if module not in reached:
            reached.add(module)
            waiting += IMPORTS.get(module, set())
    assert "app.report.write" in MODULES
    assert not {name for name in reached if name.split(".")[0] in {"panel", "panel_material_ui"}}


def test_no_import_goes_round_in_a_circle() -> None:
    graph = {name: {other for other in IMPORTS[name] if other in MODULES} for name in MODULES}
    # The root package re-exports its floors, and importing any of them loads it first.
    graph["vsep"] = set()
    assert len(list(graphlib.TopologicalSorter(graph).static_order())) == len(MODULES)


def test_the_reader_of_imports_sees_every_form() -> None:
    tree = ast.parse(
        "import os.path\nfrom vsep.signal import radar\nfrom vsep._arrays import frozen\n"
        "def inside():\n    from scipy import fft\n"
    )
    assert set(imports_of(tree)) == {"os.path", "vsep.signal.radar", "vsep._arrays", "scipy"}
    assert imports_at_load(tree) == {"os.path", "vsep.signal.radar", "vsep._arrays"}
