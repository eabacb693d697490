"""Write and read frame files.

A frame file is an `.npz` archive without pickles: samples, radar, and whatever else is known. All
commands read it; [its arrays](../files.md) can be written by any program that knows NumPy.
"""

import numpy as np

import vsep

scenario, observation = vsep.simulate_preset("simulation-1", snr_db=30.0, sir_db=-20.0, seed=3)
frame = vsep.Frame(
    received=observation.received,
    radar=scenario.radar,
    anti_aliasing_filter=scenario.anti_aliasing_filter,
    truth=observation.truth,
)
vsep.write_frame("frame.npz", frame)

stored = vsep.read_frame("frame.npz")
print(stored.radar)
assert stored.radar == scenario.radar
assert np.array_equal(stored.received, observation.received)

# The same by hand, with what is needed and nothing else.
radar = scenario.radar
np.savez(
    "by-hand.npz",
    received=observation.received,
    sample_rate_hz=radar.sample_rate_hz,
    slope_hz_per_s=radar.slope_hz_per_s,
    start_frequency_hz=radar.start_frequency_hz,
    ramp_period_s=radar.ramp_period_s,
)
assert vsep.read_frame("by-hand.npz").radar == radar

# What cannot be used is told in one sentence.
np.savez("without-radar.npz", received=observation.received)
try:
    vsep.read_frame("without-radar.npz")
except vsep.InputError as error:
    print(error)
    assert "without-radar.npz" in str(error)
else:
    raise AssertionError("a frame file without a radar was read")
