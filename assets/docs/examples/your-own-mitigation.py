"""Add a mitigation method of your own.

A method is a frozen record of settings with `init`, `step` and `terminate`; see
`vsep.mitigation.method`. It is given a frame and a mask of interfered samples, and repairs it. This
one puts in the place of a flagged sample that of the nearest ramp in which the same fast time is
clean: good for what hardly moves from ramp to ramp. [Extending](../extending.md) says how a package
of yours brings it to the command line, the pages and the studies.
"""

from dataclasses import dataclass

import numpy as np

import vsep
from vsep.analysis.repair import windowed_error_db
from vsep.mitigation.method import require_clean


@dataclass(frozen=True, kw_only=True)
class NearestRamp:
    """Replace a flagged sample by that of the nearest ramp in which it is clean."""

    name: str = "nearest-ramp"

    def init(self, received: np.ndarray, mask: np.ndarray) -> vsep.MitigationState:
        """Start from the frame as received."""
        require_clean(mask)
        return vsep.MitigationState(iteration=0, cleaned=received)

    def step(
        self, received: np.ndarray, mask: np.ndarray, state: vsep.MitigationState
    ) -> vsep.MitigationState:
        """Repair the whole frame at once."""
        ramps = np.arange(len(received))
        distance = np.abs(ramps[:, None] - ramps)[:, :, None] + np.where(mask, np.inf, 0.0)
        nearest = np.argmin(distance, axis=1)
        cleaned = np.where(mask, np.take_along_axis(received, nearest, axis=0), received)
        cleaned.flags.writeable = False
        return vsep.MitigationState(iteration=state.iteration + 1, cleaned=cleaned, change=0.0)

    def terminate(self, state: vsep.MitigationState) -> vsep.Termination:
        """One step is all there is."""
        done = state.iteration > 0
        return vsep.Termination.CONVERGED if done else vsep.Termination.RUNNING


if __name__ == "__main__":
    vsep.check_mitigation(NearestRamp)  # the rules that every method keeps

    _, observation = vsep.simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=7)
    truth, received = observation.truth, observation.received
    mask = truth.perfect_mask()
    own = vsep.mitigate(NearestRamp(), received, mask).cleaned
    zeroed = vsep.mitigate(vsep.make_mitigation("zeroing"), received, mask).cleaned
    errors_db = {
        "received": windowed_error_db(truth.object_signal, received),
        "zeroing": windowed_error_db(truth.object_signal, zeroed),
        "nearest-ramp": windowed_error_db(truth.object_signal, own),
    }
    for name, error_db in errors_db.items():
        print(f"{name:<13}{error_db:6.1f} dB")
    assert min(errors_db, key=errors_db.__getitem__) == "nearest-ramp"

    # The object itself goes to a study, worker processes included.
    study = vsep.make_study(
        "fig-5-methods", methods=("factorised", NearestRamp()), realizations=1, selection="4"
    )
    (rows,) = vsep.record_study(study, "rows.jsonl")
    for row in rows:
        print(f"{row['method']:<13}{row['misses']} misses, {row['false_alarms']} false alarms")
    assert [row["method"] for row in rows] == ["factorised", "nearest-ramp"]
    assert {row["status"] for row in rows} == {"done"}
