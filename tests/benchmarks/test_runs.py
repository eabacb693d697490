"""Time of whole runs and single steps, and how it grows with the size of the problem."""

from itertools import cycle

import pytest

from tests.benchmarks.scenes import drawn_problem, preset_problem
from vsep.inference.core.run import run
from vsep.reference import ReferenceSeparator
from vsep.reference_costs import chirp_dictionary

CASES = {
    "Simulation I, SIR -20 dB": ("simulation-1", 30.0, -20.0),
    "Simulation I, SIR +10 dB": ("simulation-1", 30.0, 10.0),
    "Simulation II-a, SIR -20 dB": ("simulation-2-a", 60.0, -20.0),
    "Simulation II-b, SIR -20 dB": ("simulation-2-b", 60.0, -20.0),
    "Simulation II-c, SIR -20 dB": ("simulation-2-c", 60.0, -20.0),
    "Simulation II-c, SIR +10 dB": ("simulation-2-c", 60.0, 10.0),
}
NUM_FRAMES = 5  # of each case, one after the other: some take twice the iterations of others
NUM_CYCLES = 6
REFERENCE_ITERATIONS = 16  # of the robust schedule; the letter ends late or never
REFERENCE = ["Simulation I, SIR -20 dB", "Simulation II-c, SIR -20 dB"]
LARGE = {
    "64 x 256, 30 objects, 16 bursts": (64, 256, 30, 16),
    "128 x 512, 100 objects, 32 bursts": (128, 512, 100, 32),
    "256 x 1024, 300 objects, 32 bursts": (256, 1024, 300, 32),
}
# 16 ramps of 128 samples with 10 objects and 8 bursts, one of the numbers changed at a time; many
# objects need room.
GROWTH = {
    "samples": {size: ((16, size), 10) for size in (64, 128, 256, 512, 1024)},
    "ramps": {size: ((size, 128), 10) for size in (8, 16, 32, 64)},
    "objects": {size: ((64, 256), size) for size in (10, 75, 150, 300)},
}
GROWTH_ROUNDS = 3


def several_problems(case):
    """Frames of one case; all of them have the radar and the filter of the first."""
    return [preset_problem(*CASES[case], seed=seed) for seed in range(1, NUM_FRAMES + 1)]


@pytest.mark.benchmark(group="whole run")
@pytest.mark.parametrize("case", CASES)
def test_whole_run(timed, case):
    problems = cycle(several_problems(case))

    def run_next():
        problem = next(problems)
        return run(problem.separator, problem.received)

    rounds = NUM_FRAMES * NUM_CYCLES
    solution = timed(run_next, part=f"run: {case}", rounds=rounds, frames=NUM_FRAMES)
    assert solution.objects.num_components >= 1


# That it finds the same is for tests/vsep/test_reference.py to say; here its time is taken.
@pytest.mark.slow
@pytest.mark.benchmark(group="whole run")
@pytest.mark.parametrize("case", REFERENCE)
def test_reference_run(timed, case):
    """The algorithms as printed, for as long as a run with the robust schedule takes."""
    problems = several_problems(case)
    model = problems[0].separator.model
    reference = ReferenceSeparator(model=model, max_iterations=REFERENCE_ITERATIONS)
    chirp_dictionary(model)  # is made once for all frames, as the fast one's bank
    frames = iter([problem.received for problem in problems])
    part = f"run: {case}"
    solution = timed(
        lambda: run(reference, next(frames)), part=part, way="reference", rounds=NUM_FRAMES
    )
    assert solution.state.iteration == REFERENCE_ITERATIONS


# That all objects of the larger one are found is for tests/vsep/test_scale.py to say.
@pytest.mark.slow
@pytest.mark.benchmark(group="whole run")
@pytest.mark.parametrize("size", LARGE)
def test_run_of_a_large_frame(timed, size):
    num_ramps, num_samples, num_objects, num_bursts = LARGE[size]
    problem = drawn_problem((num_ramps, num_samples), num_objects, num_bursts)
    solution = timed(
        lambda: run(problem.separator, problem.received), part=f"run: {size}", rounds=1
    )
    assert solution.objects.num_components >= 0.8 * num_objects


@pytest.mark.benchmark(group="one step")
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("stage", ["first", "settled"])
def test_step(timed, stage, case):
    problem = preset_problem(*CASES[case])
    separator, received = problem.separator, problem.received
    state = separator.init(received) if stage == "first" else run(separator, received).state
    part = f"{stage} step: {case}"
    after, _ = timed(lambda: separator.step(received, state), part=part)
    assert after.iteration == state.iteration + 1


@pytest.mark.benchmark(group="growth")
@pytest.mark.parametrize(
    ("number", "size"), [(number, size) for number, sizes in GROWTH.items() for size in sizes]
)
def test_growth(timed, benchmark, number, size):
    shape, num_objects = GROWTH[number][size]
    problem = drawn_problem(shape, num_objects, 8)
    solution = timed(
        lambda: run(problem.separator, problem.received),
        part=number,
        rounds=GROWTH_ROUNDS,
        size=size,
    )
    benchmark.extra_info["iterations"] = solution.iterations
    assert solution.objects.num_components >= 0.8 * num_objects
