"""Figures of a separated capture: how much of it is hit, how strongly, and what follows.

Two radars can run side by side if what the one leaves in the other costs little: as it is, or after
the hit samples are mended.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vsep.files.frame import Frame
from vsep.inference.core.state import SeparationState
from vsep.recordings.saturation import num_saturated
from vsep.units import to_db

HARMLESS_DB: Final = 1.0
"""Rise of the noise from which interference is more than a nuisance."""
MOST_HIT: Final = 0.3
"""Share of samples up to which the rest of a ramp carries the objects; beyond, lines widen."""
MOST_SATURATED: Final = 0.01
"""Share of samples whose content is lost that nothing notices."""


@dataclass(frozen=True, kw_only=True, slots=True)
class InterferenceFigures:
    """What interference does to a capture."""

    sample_share: float  #: of the samples that bursts above the noise hit
    ramp_share: float  #: of the ramps with such samples
    saturated_samples: int  #: at the converter's full scale
    saturated_share: float
    inr_db: (
        float  #: mean power of bursts in the samples they hit over the noise; NaN without bursts
    )
    floor_rise_db: float  #: of the noise of a range-Doppler map, if nothing is done
    blanking_loss_db: float  #: of the objects' SNR, if hit samples are zeroed

    @property
    def can_run_side_by_side(self) -> bool:
        """Whether the interferer and this radar may stay as they are."""
        if self.saturated_share > MOST_SATURATED:
            return False
        return self.floor_rise_db < HARMLESS_DB or self.sample_share <= MOST_HIT

    @property
    def verdict(self) -> str:
        """Say in one sentence whether both radars can run side by side."""
        if self.saturated_share > MOST_SATURATED:
            return (
                f"No: {self.saturated_share:.1%} of the samples are saturated, which nothing mends."
            )
        if self.sample_share == 0.0:
            return "Yes: nothing interferes."
        if self.floor_rise_db < HARMLESS_DB:
            return f"Yes, as they are: the noise rises by {self.floor_rise_db:.1f} dB."
        if self.sample_share <= MOST_HIT:
            return (
                f"Yes, with separation: without it the noise rises by {self.floor_rise_db:.1f} dB, "
                f"and zeroing would cost {self.blanking_loss_db:.1f} dB."
            )
        return (
            f"No: {self.sample_share:.0%} of the samples are hit; `vsep advise` looks for a better "
            "timing."
        )

    @property
    def summary(self) -> str:
        """Say the figures and the verdict on a line."""
        inr = "" if self.sample_share == 0.0 else f", INR {self.inr_db:.0f} dB"
        return (
            f"bursts in {self.ramp_share:.0%} of the ramps and {self.sample_share:.1%} of the "
            f"samples{inr}, {self.saturated_samples} samples saturated. {self.verdict}"
        )

    def line(self) -> dict[str, Any]:
        """Return the figures for a result line."""
        return {
            "sample_share": round(self.sample_share, 6),
            "ramp_share": round(self.ramp_share, 6),
            "saturated_samples": self.saturated_samples,
            "inr_db": None if math.isnan(self.inr_db) else round(self.inr_db, 2),
            "floor_rise_db": round(self.floor_rise_db, 2),
            "blanking_loss_db": round(self.blanking_loss_db, 2),
            "side_by_side": self.can_run_side_by_side,
            "verdict": self.verdict,
        }


def interference_figures(frame: Frame, state: SeparationState) -> InterferenceFigures:
    """Compute the figures of a frame from the state of its separation.

    Parameters
    ----------
    frame : Frame
        The capture; its largest word is one.
    state : SeparationState
        Of one antenna or of all together.
    """
    power = np.abs(state.interference_signal) ** 2 * state.noise_precision
    hit = power > 1.0
    share = float(np.mean(hit))
    # Of several antennas a ramp has a row in each.
    rows = hit.any(axis=1).reshape(-1, frame.radar.num_ramps)
    signal = frame.received if frame.antennas is None else frame.antennas
    saturated = num_saturated(signal)
    return InterferenceFigures(
        sample_share=share,
        ramp_share=float(np.mean(rows.any(axis=0))),
        saturated_samples=saturated,
        saturated_share=saturated / signal.size,
        inr_db=float(to_db(np.mean(power[hit]))) if hit.any() else math.nan,
        floor_rise_db=float(to_db(1.0 + np.mean(power))),
        blanking_loss_db=-2.0 * float(to_db(max(1.0 - share, 1e-6))),
    )
