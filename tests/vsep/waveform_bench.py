"""What interferers that send no chirps cost the objects, beside the masked estimator.

As a script it prints a line for every waveform and preset: objects missed by the separation and by
the masked estimator with the mask of the truth, false objects, bursts, iterations, what is
recognised:

    python -m tests.vsep.waveform_bench 8 500
"""

import sys
from collections import Counter

import numpy as np

from vsep.analysis.metrics import frame_errors
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.masked import MaskedSeparator
from vsep.inference.waveforms import recognised_waveforms
from vsep.presets.scenes import simulate_preset
from vsep.signal.template import SignalModel

SCENES = {"hopping-chirps": 40.0, "phase-coded": 60.0}  # presets and SNRs in dB
WAVEFORMS = ("stepped", "phase-coded", "ofdm")


def missed_and_false(objects, truth, shape):
    """Objects of the truth that are not found within a cell, and those found that are not there."""
    found = frame_errors(
        np.stack([truth.beats, truth.dopplers], 1),
        np.stack([objects.beats, objects.dopplers], 1),
        shape,
    )
    hits = len(found.gospa.true_indices)
    return len(truth.beats) - hits, objects.num_components - hits


def compared(preset, waveform, seed, sir_db=-20.0):
    """One frame, separated and masked, as a row."""
    scenario, observation = simulate_preset(
        preset, snr_db=SCENES[preset], sir_db=sir_db, seed=seed, interferer_waveform=waveform
    )
    truth, received = observation.truth, observation.received
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    solution = run(FactorisedSeparator(model=model), received)
    masked = run(MaskedSeparator(model=model, mask=truth.perfect_mask()), received)
    words = [
        each.waveform for each in recognised_waveforms(solution.state, scenario.radar, received)
    ]
    return {
        "separated": missed_and_false(solution.objects, truth, model.shape),
        "masked": missed_and_false(masked.objects, truth, model.shape),
        "bursts": len(solution.state.bursts),
        "iterations": solution.state.iteration,
        "ended": solution.termination.name,
        "words": words,
    }


def main(count, first):
    """Print the table."""
    for preset in SCENES:
        for waveform in WAVEFORMS:
            rows = [compared(preset, waveform, first + seed) for seed in range(count)]
            means = [
                np.mean([row[name][place] for row in rows])
                for place in (0, 1)
                for name in ("separated", "masked")
            ]
            sys.stdout.write(
                f"{preset:15} {waveform:12} missed {means[0]:.2f} (masked {means[1]:.2f}), "
                f"false {means[2]:.2f} ({means[3]:.2f}), "
                f"bursts {np.mean([row['bursts'] for row in rows]):.1f}, "
                f"iterations {[row['iterations'] for row in rows]}, "
                f"{dict(Counter(word for row in rows for word in row['words']))}\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:3]))
