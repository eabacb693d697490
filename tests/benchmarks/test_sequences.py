"""Time of a frame in a sequence, and of what a user knows as the floor: zero, transform."""

from itertools import cycle

import numpy as np
import pytest
from scipy import fft

from tests.benchmarks.scenes import SAMPLE_RATE_HZ, drawn_problem
from vsep.files.frame import Frame
from vsep.presets.scenes import simulate_preset
from vsep.presets.street import street_frame
from vsep.signal.radar import ChirpSequence
from vsep.signal.spectra import window_weights
from vsep.tracking.sequence import SequenceSeparator, SequenceState
from vsep.tracking.sources import frame_of_street

LOUD = 10.0  # times the median power: an interfered sample, as products find it
NUM_FRAMES = 5  # of each case, one after the other
PRESETS = {
    "Simulation I, SIR -20 dB": ("simulation-1", 30.0, -20.0, True),
    "Simulation II-b, SIR -20 dB": ("simulation-2-b", 60.0, -20.0, True),
    "Simulation II-c, SIR -20 dB": ("simulation-2-c", 60.0, -20.0, True),
    "Simulation II-b, clean": ("simulation-2-b", 60.0, -20.0, False),
}
LARGE = ("interfered", "clean")
# Frames of the street before the ones that are timed, which are clean and interfered ones.
STREET = {"street 32 x 256, clean": 30, "street 32 x 256, interfered": 38}


def preset_frames(case):
    """Frames of one sequence of a preset."""
    name, snr_db, sir_db, interference = PRESETS[case]
    for number in range(NUM_FRAMES + 1):
        scenario, observation = simulate_preset(
            name,
            snr_db=snr_db,
            sir_db=sir_db,
            seed=1,
            frame_number=number,
            interference=interference,
        )
        yield Frame(
            received=observation.received,
            radar=scenario.radar,
            anti_aliasing_filter=scenario.anti_aliasing_filter,
        )


def large_frames(*, clean):
    """Frames of the same objects and bursts with other noise."""
    shape = 128, 512
    radar = ChirpSequence(
        start_frequency_hz=79e9,
        slope_hz_per_s=1e13,
        sample_rate_hz=SAMPLE_RATE_HZ,
        ramp_period_s=120e-6,
        num_samples=shape[1],
        num_ramps=shape[0],
    )
    for number in range(3):
        problem = drawn_problem(shape, 100, 32, noise_seed=number, clean=clean)
        yield Frame(
            received=problem.received,
            radar=radar,
            anti_aliasing_filter=problem.separator.model.anti_aliasing_filter,
        )


def next_frames(frames, **settings):
    """Separator, and pairs of the state after a frame and the next frame."""
    separator, state, pairs = SequenceSeparator(**settings), SequenceState(), []
    for frame in frames:
        pairs.append((frame, state))
        state, _ = separator.step(frame, state)
    return separator, pairs[1:]


def zeroing_of(pairs):
    """What makes range-Doppler maps of the frames of a sequence, whose loud samples are zeroed."""
    frames = cycle([frame.received for frame, _ in pairs])
    window = np.outer(*(window_weights(size, "hann") for size in pairs[0][0].received.shape))
    return lambda: zeroed_map(next(frames), window)


def zeroed_map(received, window):
    power = received.real**2 + received.imag**2
    kept = np.where(power > LOUD * np.median(power), 0.0, received)
    return np.abs(fft.fft2(kept * window)) ** 2


@pytest.mark.benchmark(group="sequence")
@pytest.mark.parametrize("case", PRESETS)
def test_frame_of_a_sequence(timed, case):
    separator, pairs = next_frames(preset_frames(case))
    turns = cycle(pairs)
    _, result = timed(
        lambda: separator.step(*next(turns)),
        part=f"in a sequence: {case}",
        rounds=4 * NUM_FRAMES,
        floor=zeroing_of(pairs),
        frames=NUM_FRAMES,
    )
    assert result.start == ("clean" if "clean" in case else "warm")


@pytest.mark.benchmark(group="sequence")
@pytest.mark.parametrize("case", STREET)
def test_frame_of_the_street(timed, case):
    first = STREET[case]
    frames = [
        frame_of_street(street_frame(number, seed=1))
        for number in range(first, first + NUM_FRAMES + 1)
    ]
    separator, pairs = next_frames(frames)
    turns = cycle(pairs)
    _, result = timed(
        lambda: separator.step(*next(turns)),
        part=f"in a sequence: {case}",
        rounds=4 * NUM_FRAMES,
        floor=zeroing_of(pairs),
        frames=NUM_FRAMES,
    )
    assert result.start == ("clean" if "clean" in case else "warm")


@pytest.mark.slow
@pytest.mark.benchmark(group="sequence")
@pytest.mark.parametrize("case", LARGE)
def test_large_frame_of_a_sequence(timed, case):
    # Objects of the drawn problem stand still in range: hardly any time passes.
    separator, pairs = next_frames(
        large_frames(clean=case == "clean"), cycle_s=1e-4, range_migration="neglected"
    )
    turns = cycle(pairs)
    _, result = timed(
        lambda: separator.step(*next(turns)),
        part=f"in a sequence: 128 x 512, 100 objects, {case}",
        rounds=len(pairs),
        floor=zeroing_of(pairs),
    )
    assert result.solution.objects.num_components >= 80
