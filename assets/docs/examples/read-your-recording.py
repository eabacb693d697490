"""Read your recording.

Samples as a sensor or MATLAB leaves them, and a few settings that the file does not hold. Here a
program other than *vsep* has written an array of (samples, antennas, ramps) in the sign in which
objects lie at positive beat frequency; [all formats and settings](../recordings.md).
"""

import numpy as np

import vsep
from vsep.recordings.convert import convert_recording
from vsep.recordings.settings import parse_settings

SLOPE_HZ_PER_S, SAMPLE_RATE_HZ, RAMP_PERIOD_S = 30e12, 10e6, 40e-6
SPEED_OF_LIGHT_MPS = 299_792_458.0
RANGE_M = 12.0

# One object at 12 m, at rest, in noise: what the sensor recorded.
rng = np.random.default_rng(1)
n, antennas, ramps = np.arange(256), 2, 16
beat_hz = SLOPE_HZ_PER_S * 2.0 * RANGE_M / SPEED_OF_LIGHT_MPS
tone = np.exp(2j * np.pi * beat_hz / SAMPLE_RATE_HZ * n)
noise = rng.normal(size=(256, antennas, ramps)) + 1j * rng.normal(size=(256, antennas, ramps))
np.save("adc.npy", tone[:, None, None] + 0.3 * noise)

settings = parse_settings(
    {
        "format": "npy",
        "axes": "samples,antennas,ramps",
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": SLOPE_HZ_PER_S,
        "sample_rate_hz": SAMPLE_RATE_HZ,
        "ramp_period_s": RAMP_PERIOD_S,
    }
)
frame, remarks = convert_recording("adc.npy", settings)
for remark in remarks:  # what looks wrong with the settings, with advice
    print(remark)
vsep.write_frame("frame.npz", frame)

model = vsep.SignalModel.of_radar(frame.radar, frame.assumed_filter, frame.num_antennas)
solution = vsep.run(vsep.FactorisedSeparator(model=model), frame.antennas)
(range_m,) = frame.radar.range_from_beat(solution.objects.beats)
print(f"one object at {range_m:.3f} m")
assert abs(range_m - RANGE_M) < 0.01
