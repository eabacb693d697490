"""Rows and trials of a study as tests of several modules need them."""

from collections.abc import Callable
from typing import Any

import pytest

from vsep._version import __version__
from vsep.studies.study import Point, Trial, TrialSettings

FrameRow = Callable[..., dict[str, Any]]
ROOT_CRLB = 1e-4


def _row(realization=0, method="factorised", errors=(1e-4,), **changes):
    """A finished frame of Simulation I with one object."""
    point = Point(panel="3b", scene="simulation-1", snr_db=30.0, sir_db=0.0)
    values = {
        "study": "fig-3",
        "point_index": 13,
        "point": point.parameters(),
        "realization": realization,
        "method": method,
        "status": "done",
        "num_ramps": 1,
        "num_samples": 256,
        "num_objects_true": 1,
        "num_objects": len(errors),
        "misses": 1 - len(errors),
        "false_alarms": 0,
        "errors": [abs(error) for error in errors],
        "beat_errors": list(errors),
        "beat_stds": [ROOT_CRLB] * len(errors),
        "root_crlb": ROOT_CRLB,
        "gospa": 0.0,
        "sinr_db": None,
        "evm": 0.1,
        "separability_db": -3.0,
        "separability_weakest_db": -3.0,
        "iterations": 5,
        "termination": "converged",
        "seconds": 0.01,
        "version": __version__,
    }
    return values | changes


def central_differences(value, steps):
    """Derivatives of a function of two variables at zero."""
    first, second = steps
    return [
        (value(first, 0.0) - value(-first, 0.0)) / (2 * first),
        (value(0.0, second) - value(0.0, -second)) / (2 * second),
    ]


def small_trial(point_index, methods, realization=0, **changes):
    """A trial of a study named test; Simulation I at SNR 30 dB and SIR -20 dB by default."""
    values = {"panel": "a", "scene": "simulation-1", "snr_db": 30.0, "sir_db": -20.0} | changes
    return Trial(
        study="test",
        point_index=point_index,
        point=Point(**values),
        realization=realization,
        methods=methods,
        settings=TrialSettings(),
    )


@pytest.fixture(scope="session")
def frame_row() -> FrameRow:
    """Make a finished row of one object in one ramp; the root CRLB is 1e-4."""
    return _row
