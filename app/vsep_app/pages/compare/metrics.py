"""Metrics of a method's frame for the table and the curve of a comparison."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray
from vsep.analysis.metrics import frame_errors
from vsep.analysis.signal_metrics import signal_metrics
from vsep.inference.core.state import SeparationState
from vsep.signal.scene import GroundTruth


@dataclass(frozen=True, kw_only=True, eq=False)
class MethodMetrics:
    """How a method does so far; None or NaN where the truth or a result is missing."""

    #: Objects without an estimate, and estimates without an object.
    misses: int | None = None
    false_alarms: int | None = None
    #: Of the cleaned frame, all of `vsep.analysis.signal_metrics.SIGNAL_METRICS`.
    windowed_error_db: float = float("nan")
    sinr_db: float = float("nan")
    nsinr_db: float = float("nan")
    gtnr: float = float("nan")
    #: Iterations of the repair and of the estimator; None for a stage that a method has not.
    num_repairs: int | None = None
    num_detections: int | None = None
    #: How long they took.
    repair_s: float = 0.0
    detection_s: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameResult:
    """How all methods did on one frame of a sequence, in the order of the methods."""

    frame_number: int
    method_runs: tuple[MethodMetrics, ...]


class SignalMeasures(NamedTuple):
    """Metrics of a cleaned frame; NaN without a truth."""

    windowed_error_db: float = float("nan")
    sinr_db: float = float("nan")
    nsinr_db: float = float("nan")
    gtnr: float = float("nan")


class Verdict(NamedTuple):
    """Misses and false alarms; None where the objects are not known."""

    misses: int | None = None
    false_alarms: int | None = None


def measure_signal(
    truth: GroundTruth | None, received: ComplexArray, cleaned: ComplexArray
) -> SignalMeasures:
    """Compare a cleaned frame with the truth."""
    return SignalMeasures(**signal_metrics(truth, received, cleaned))


def judge_objects(truth: GroundTruth | None, state: SeparationState | None) -> Verdict:
    """Compare the objects of a state with the true ones.

    Of a recorded frame with simulated bursts the truth holds no objects and no noise level.
    """
    if truth is None or state is None or np.isnan(truth.noise_precision):
        return Verdict()
    true = np.column_stack([truth.beats, truth.dopplers])
    found = np.column_stack([state.objects.beats, state.objects.dopplers])
    num_ramps, num_samples = truth.object_signal.shape
    errors = frame_errors(true, found, (num_ramps, num_samples))
    return Verdict(errors.misses, errors.false_alarms)
