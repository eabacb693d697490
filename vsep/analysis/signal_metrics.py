"""Metrics of cleaned frames by name, over which pages, studies, reports and the bench iterate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from vsep._typing import BoolArray, ComplexArray
from vsep.analysis.map_metrics import gtnr, nsinr_db, target_cells
from vsep.analysis.metrics import sinr_db
from vsep.analysis.repair import windowed_error_db
from vsep.signal.scene import GroundTruth


class CleanedFrame(NamedTuple):
    """A frame before and after a method, with its truth."""

    truth: GroundTruth
    received: ComplexArray  #: (P, N)
    cleaned: ComplexArray  #: (P, N)

    @property
    def targets(self) -> BoolArray:
        """(P, N) cells of the map that belong to the true objects."""
        num_ramps, num_samples = self.received.shape
        return target_cells(self.truth.beats, self.truth.dopplers, (num_ramps, num_samples))


@dataclass(frozen=True, kw_only=True, slots=True)
class SignalMetric:
    """One metric of a cleaned frame; NaN where the truth does not tell it."""

    name: str  #: as rows and tables spell it
    #: for a reader: heading, and one or two sentences
    label: str
    help: str
    digits: int  #: decimals that a table shows
    measure: Callable[[CleanedFrame], float]


_METRICS = (
    SignalMetric(
        name="windowed_error_db",
        label="windowed error [dB]",
        help="Error of the cleaned frame under the two-dimensional Hann window of range-Doppler "
        "processing, over the energy of the objects.",
        digits=1,
        measure=lambda case: windowed_error_db(case.truth.object_signal, case.cleaned),
    ),
    SignalMetric(
        name="sinr_db",
        label="SINR [dB]",
        help="Energy of the objects over that of all else in the cleaned frame.",
        digits=1,
        measure=lambda case: sinr_db(case.truth.object_signal, case.cleaned),
    ),
    SignalMetric(
        name="nsinr_db",
        label="NSINR [dB]",
        help="Mean power of the objects' cells of the range-Doppler map over that of all others, "
        "against the same frame without interference: 0 dB is as good as none.",
        digits=1,
        measure=lambda case: nsinr_db(
            case.cleaned, case.received - case.truth.interference_signal, case.targets
        ),
    ),
    SignalMetric(
        name="gtnr",
        label="gTNR",
        help="How well one threshold tells the objects' cells of the range-Doppler map from all "
        "others, without a detector: 1 always, 0 not at all.",
        digits=2,
        measure=lambda case: gtnr(case.cleaned, case.targets),
    ),
)
SIGNAL_METRICS: Final[dict[str, SignalMetric]] = {metric.name: metric for metric in _METRICS}
"""All of them by name."""


def signal_metrics(
    truth: GroundTruth | None, received: ComplexArray, cleaned: ComplexArray
) -> dict[str, float]:
    """Measure a cleaned frame by all of `SIGNAL_METRICS`.

    Parameters
    ----------
    truth : GroundTruth or None
        What the frame is made of; without it, or without objects, all are NaN.
    received, cleaned : (P, N) complex
        The frame before and after a method.

    Examples
    --------
    >>> from vsep.presets.scenes import simulate_preset
    >>> _, observation = simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=1)
    >>> truth, received = observation.truth, observation.received
    >>> clean = signal_metrics(truth, received, received - truth.interference_signal)
    >>> clean["nsinr_db"], clean["gtnr"] > signal_metrics(truth, received, received)["gtnr"]
    (0.0, True)
    """
    if truth is None or not np.any(truth.object_signal):
        return dict.fromkeys(SIGNAL_METRICS, float("nan"))
    case = CleanedFrame(truth, received, cleaned)
    return {name: metric.measure(case) for name, metric in SIGNAL_METRICS.items()}
