"""Who may import whom: the floors of the package, read from the source without running it."""

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted([*ROOT.glob("vsep/**/*.py"), *ROOT.glob("app/vsep_app/**/*.py")])

# Lower floors know nothing of higher ones; rooms of the same height only of themselves.
FLOORS = {
    "vsep.errors": 0,
    "vsep._typing": 0,
    "vsep._version": 0,
    "vsep._processes": 0,
    "vsep._entry_points": 1,
    "vsep._optional": 1,
    "vsep._shipped": 1,
    "vsep._validation": 1,
    "vsep.units": 1,
    "vsep._state_tree": 1,
    "vsep.registry": 2,
    "vsep.parameters": 2,
    "vsep.kernels": 2,
    "vsep.signal": 3,
    "vsep.inference": 4,
    "vsep.analysis": 4,
    "vsep.presets": 4,
    # The algorithms as printed, for tests; nothing of the estimator may know of them.
    "vsep.reference_costs": 5,
    "vsep.reference": 6,
    # Interferer timings are of the analysis, the search that they guide of the inference.
    "vsep.two_pass": 5,
    # Groups are made of what an estimator found and left.
    "vsep.grouping": 5,
    "vsep.waveforms": 5,
    # A detector of interfered samples fits objects.
    "vsep.mitigation": 5,
    # Objects under a burst are filled in by a method of mitigation.
    "vsep.calibration": 6,
    "vsep.files": 6,
    # The rows of a study are written as result lines are.
    "vsep.check": 7,
    "vsep.studies": 7,
    "vsep.recordings": 7,
    "vsep.tracking": 7,
    # The trials of a separability map are those of the studies.
    "vsep.separability": 8,
    # The bench is a study of frozen scenes.
    "vsep.bench": 8,
    # Claims of the papers are measured by studies.
    "vsep.reproduction": 8,
    "vsep": 8,
    "vsep.__main__": 9,
}
DRAWING = {"panel", "panel_material_ui", "bokeh", "holoviews"}
# `vsep` beside the standard library; llvmlite is Numba's own other half.
LIBRARIES = {"numpy", "scipy", "numba", "llvmlite", "vsep"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts[1:] if parts[0] == "app" else parts
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


def reached_from(*modules: str) -> set[str]:
    """All that modules load, those that they load included."""
    reached: set[str] = set()
    waiting = set(modules)
    while waiting:
        module = waiting.pop()
        reached.add(module)
        waiting |= IMPORTS.get(module, set()) - reached
    return reached


def room(module: str) -> str:
    """The entry of `FLOORS` that a module of vsep belongs to."""
    prefix = ".".join(module.split(".")[:2])
    return prefix if prefix in FLOORS else module


def in_package(package: str) -> list[str]:
    return [name for name in MODULES if name == package or name.startswith(f"{package}.")]


@pytest.mark.parametrize("module", in_package("vsep"))
def test_vsep_needs_only_numpy_scipy_and_numba(module: str) -> None:
    allowed = LIBRARIES | sys.stdlib_module_names
    # The one exception: three lines that find the command line, which lives with the application.
    allowed = allowed | ({"vsep_app"} if module == "vsep.__main__" else set())
    assert {name.split(".")[0] for name in IMPORTS[module]} <= allowed


@pytest.mark.parametrize("module", in_package("vsep"))
def test_floors_only_look_down(module: str) -> None:
    own = room(module)
    assert own in FLOORS, f"{module} belongs to no floor"
    for imported in IMPORTS[module]:
        if imported.split(".")[0] == "vsep" and room(imported) != own:
            assert FLOORS[room(imported)] < FLOORS[own], imported


@pytest.mark.parametrize("module", [*in_package("vsep.inference"), *in_package("vsep.mitigation")])
def test_no_estimator_can_see_the_truth(module: str) -> None:
    hidden = {"vsep.signal.simulate", "vsep.presets.scenes", "vsep.signal.scene"}
    hidden |= {"vsep.signal.bursts"}
    assert not IMPORTS[module] & hidden


@pytest.mark.parametrize(
    "module", ["vsep_app.model.settings", "vsep_app.jobs.run_session", "vsep_app.model.picture"]
)
def test_the_model_of_the_dashboard_draws_nothing(module: str) -> None:
    assert not {name.split(".")[0] for name in IMPORTS[module]} & DRAWING


@pytest.mark.parametrize("module", in_package("vsep_app.views"))
def test_views_draw_pictures_and_compute_nothing(module: str) -> None:
    assert not [name for name in IMPORTS[module] if name.split(".")[0] == "vsep"]


def test_a_report_needs_no_web_page() -> None:
    modules = ["vsep_app.report.write", "vsep_app.report.batch", "vsep_app.report.animation"]
    assert set(modules) <= set(MODULES)
    reached = reached_from(*modules)
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
