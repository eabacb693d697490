import numpy as np

from vsep.mitigation.masks.amplitude import amplitude_mask

SAMPLE = np.arange(64)


def test_a_burst_that_only_turns_faster_is_found_by_its_steps():
    # As strong as the line it interrupts, half a turn from sample to sample.
    frame = np.exp(-0.02j * np.pi * SAMPLE)
    frame[20:40] = np.exp(1j * np.pi * SAMPLE[20:40])
    mask = amplitude_mask(frame[None])[0]
    assert mask[21:39].all()
    assert not mask[:18].any()
    assert not mask[42:].any()


def test_a_burst_passing_through_zero_stays_one_run():
    frame = np.ones(64, dtype=complex)
    frame[10:30] = 20.0
    frame[18:20] = 0.5
    assert amplitude_mask(frame[None])[0, 10:30].all()
