"""Fixtures that tests of several modules share: tiny radars and frames, and where things are."""

import ast
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from vsep.presets.scenes import preset_radar
from vsep.signal.radar import ChirpSequence

# The same examples in every run: a failure on one machine is a failure on all.
settings.register_profile("vsep", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("vsep")

FrameArrays = Callable[..., dict[str, Any]]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the choice of tests by what they load."""
    parser.addoption("--loading", metavar="LIBRARY", help="only files whose tests load a library")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave the browser to the end: its driver keeps an event loop running in this thread."""
    items.sort(key=lambda item: item.get_closest_marker("ui") is not None)
    library = config.getoption("--loading")
    if library is not None:
        loading = {path for path in {item.path for item in items} if loads(path, library)}
        config.hook.pytest_deselected(items=[item for item in items if item.path not in loading])
        items[:] = [item for item in items if item.path in loading]


def loads(path: Path, library: str) -> bool:
    """Whether the tests of a file load a library, by themselves or by the served dashboard."""
    from tests.test_imports import imports_of, reached_from

    text = path.read_text()
    reached = reached_from(*imports_of(ast.parse(text)))
    return "app_server" in text or library in {name.split(".")[0] for name in reached}


@pytest.fixture(scope="session")
def repository() -> Path:
    """Top of the checkout."""
    return Path(__file__).parents[1]


@pytest.fixture(scope="session")
def small_radar() -> ChirpSequence:
    """Four ramps of 32 samples; the other values are those of Simulation II."""
    return replace(preset_radar("simulation-2-a"), num_samples=32, num_ramps=4)


@pytest.fixture
def frame_arrays() -> FrameArrays:
    """Make the arrays of a valid frame file: one object in a little noise, 4 ramps x 32 samples."""

    def make(**changes: Any) -> dict[str, Any]:
        rng = np.random.default_rng(5)
        ramp, sample = np.mgrid[:4, :32]
        signal = np.exp(-2j * np.pi * (0.2 * sample + 0.1 * ramp))
        noise = rng.normal(size=(4, 32)) + 1j * rng.normal(size=(4, 32))
        arrays = {
            "received": signal + 0.05 * noise,
            "sample_rate_hz": 5.1e6,
            "slope_hz_per_s": 1e13,
            "start_frequency_hz": 79e9,
            "ramp_period_s": 25e-6,
        }
        return {key: value for key, value in (arrays | changes).items() if value is not None}

    return make


@pytest.fixture(scope="session")
def compiled_kernels() -> None:
    """Machine code is kept: compiling it takes more memory than what is done with it."""
    from vsep_app.jobs.warmup import compile_everything

    compile_everything()
