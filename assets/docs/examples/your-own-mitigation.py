"""Add a mitigation method of your own.

A method is a frozen record of settings with `init`, `step` and `finished`; see
`vsep.mitigation.method`. It is given a frame and a mask of interfered samples, and repairs it. This
one puts in the place of a flagged sample that of the nearest ramp in which the same fast time is
clean: good for what hardly moves from ramp to ramp.
"""

from dataclasses import dataclass

import numpy as np

import vsep
from vsep.analysis.repair import windowed_error_db
from vsep.mitigation.method import MitigationState, iterate_mitigation, mitigate, require_clean
from vsep.mitigation.registry import make_mitigation


@dataclass(frozen=True, kw_only=True)
class NearestRamp:
    """Replace a flagged sample by that of the nearest ramp in which it is clean."""

    name: str = "nearest-ramp"

    def init(self, received: np.ndarray, mask: np.ndarray) -> MitigationState:
        """Start from the frame as received."""
        require_clean(mask)
        return MitigationState(iteration=0, cleaned=received)

    def step(
        self, received: np.ndarray, mask: np.ndarray, state: MitigationState
    ) -> MitigationState:
        """Repair the whole frame at once."""
        ramps = np.arange(len(received))
        distance = np.abs(ramps[:, None] - ramps)[:, :, None] + np.where(mask, np.inf, 0.0)
        nearest = np.argmin(distance, axis=1)
        cleaned = np.where(mask, np.take_along_axis(received, nearest, axis=0), received)
        cleaned.flags.writeable = False
        return MitigationState(iteration=state.iteration + 1, cleaned=cleaned, change=0.0)

    def finished(self, state: MitigationState) -> bool:
        """One step is all there is."""
        return state.iteration > 0


_, observation = vsep.simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=7)
truth, received = observation.truth, observation.received
mask = truth.perfect_mask()

own = mitigate(NearestRamp(), received, mask).cleaned
zeroed = mitigate(make_mitigation("zeroing"), received, mask).cleaned
for name, cleaned in (("received", received), ("zeroing", zeroed), ("nearest-ramp", own)):
    print(f"{name:<13}{windowed_error_db(truth.object_signal, cleaned):6.1f} dB")

# What every method must do: keep clean samples, and give the same from the same.
assert np.array_equal(own[~mask], received[~mask])
(again,) = iterate_mitigation(NearestRamp(), received, mask)
assert np.array_equal(again.cleaned, own)
assert windowed_error_db(truth.object_signal, own) < windowed_error_db(
    truth.object_signal, received
)
