"""False alarms in noise of a receiver's spectra, and weak objects under bursts of another filter.

As a script it prints the tables of `assets/docs/results.md` and `assets/docs/mitigation.md`, from
this seed on:

    python -m tests.vsep.rate_bench noise 1000
    python -m tests.vsep.rate_bench filter 1000
"""

import sys
from dataclasses import replace

import numpy as np

from tests.vsep import impaired_bench, noise_bench
from vsep.analysis.intervals import bootstrap_interval, mean
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.registry import make_estimator
from vsep.mitigation.masks.detectors import detect_interference
from vsep.signal.filters import ButterworthFilter

SPECTRA = (
    noise_bench.white,
    noise_bench.filtered,
    noise_bench.of_a_sensor,
    noise_bench.flicker,
)
FRAMES = {
    (16, 128): {0.05: 1600, 0.5: 200},
    (32, 256): {0.05: 800, 0.5: 150},
    (64, 512): {0.05: 200, 0.5: 100},
}
ORDERS = (4, 6, 8)  # of the Butterworth filter, where a raised cosine is assumed
SCENES = 20


def noise_rows(first):
    """Found over asked false alarms in noise alone, and false bursts a ramp."""
    for shape, rates in FRAMES.items():
        for rate, frames in rates.items():
            for spectrum in SPECTRA:
                separator = FactorisedSeparator(
                    model=noise_bench.model_of(*shape), false_alarm_rate=rate
                )
                alarms, bursts, converged = [], 0, 0
                for seed in range(first, first + frames):
                    rng = np.random.default_rng([8, seed])
                    solution = run(separator, noise_bench.noise_of(spectrum, *shape, rng))
                    alarms.append(solution.objects.num_components / rate)
                    bursts += len(solution.state.bursts)
                    converged += solution.termination is Termination.CONVERGED
                yield (
                    f"{shape[0]} x {shape[1]}, {rate} asked, {spectrum.__name__}, {frames} frames: "
                    f"{_with_interval(alarms)} times as many, "
                    f"{bursts / frames / shape[0]:.4f} bursts a ramp, {converged} converge"
                )


def filter_rows(first):
    """Misses of the separation and of the masked estimator with its own masks."""
    model, usual = impaired_bench.MODEL, impaired_bench.Bursts()
    for order in ORDERS:
        bursts = replace(
            usual, anti_aliasing_filter=ButterworthFilter(cutoff_hz=2.5e6, order=order)
        )
        misses, false, converged = [], [], 0
        for seed in range(first, first + SCENES):
            points, received = impaired_bench.scene(bursts, [impaired_bench.SEED, seed])
            solutions = [run(make_estimator("factorised", model), received)]
            for detector in impaired_bench.DETECTED:
                mask = detect_interference(detector, received)
                solutions.append(run(make_estimator("masked", model, mask=mask), received))
            misses.append([impaired_bench.missed(each.objects, points) for each in solutions])
            false.append(impaired_bench.ghosts(solutions[0].objects, points))
            converged += solutions[0].termination is Termination.CONVERGED
        table = np.array(misses, dtype=float)
        more = [_with_interval(table[:, 0] - masked) for masked in table[:, 1:].T]
        yield (
            f"order {order}, {SCENES} scenes: missed {table.mean(axis=0).round(2)}, more than "
            f"masked by {' and '.join(more)}, false {np.mean(false):.2f}, {converged} converge"
        )


def _with_interval(values):
    """Mean and its 95 % interval."""
    interval = bootstrap_interval(np.array(values, dtype=float), mean)
    return f"{np.mean(values):.2f} [{interval.low:.2f}, {interval.high:.2f}]"


def main(kind, first):
    """Print the lines of a table as they come."""
    for line in {"noise": noise_rows, "filter": filter_rows}[kind](first):
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
