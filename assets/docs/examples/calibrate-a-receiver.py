"""Calibrate a receiver from bursts.

A burst is a chirp seen through the receiver, so bursts tell the receiver's complex response: see
[calibration](../calibration.md). Here a steep Butterworth filter shapes the bursts of a simulated
recording; from the recording alone its response is found again.
"""

import numpy as np

import vsep
from vsep.calibration.calibrate import calibrate

radar = vsep.ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=30e12,
    sample_rate_hz=10e6,
    ramp_period_s=30e-6,
    num_samples=256,
    num_ramps=24,
)
rng = np.random.default_rng(5)
n, p = np.arange(256), np.arange(24)[:, None]
moving = np.exp(-2j * np.pi * (0.11 * n + 0.21 * p))
noise = 0.1 * (rng.normal(size=(24, 256)) + 1j * rng.normal(size=(24, 256)))
other = vsep.Interferer(
    sequence=vsep.InterfererSequence(
        start_frequency_hz=77e9,
        slope_hz_per_s=20e12,
        ramp_duration_s=29e-6,
        ramp_period_s=30.17e-6,
        num_ramps=24,
        time_offset_s=-10e-6,
    ),
    channel=vsep.Channel(
        delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, dtype=complex)
    ),
)
receiver = vsep.ButterworthFilter(cutoff_hz=4e6, order=8)
recording = vsep.add_interference(
    radar, moving + noise, [other], sir_db=-25.0, anti_aliasing_filter=receiver
)

# One antenna; the slope difference of the two radars is known here and could be estimated too.
calibration = calibrate([recording.received[None]], radar.sample_rate_hz, -10e12)
response = calibration.estimate.response
print(f"{response.num_bursts} bursts; low-pass {calibration.parametric.low_pass_hz / 1e6:.2f} MHz")

# A burst does not show the receiver's delay and gain: compare all but these.
band = np.abs(response.frequency_hz) < 0.45 * radar.sample_rate_hz
frequency_hz, estimated = response.frequency_hz[band], response.response[0, band]
known = receiver.response(frequency_hz)
delays_s = np.linspace(-1e-6, 1e-6, 8001)[:, None]
overlap = np.abs((known * np.exp(-2j * np.pi * frequency_hz * delays_s)).conj() @ estimated) ** 2
error = 1.0 - overlap.max() / (np.vdot(known, known) * np.vdot(estimated, estimated)).real
print(f"error of the response {10 * np.log10(error):.1f} dB")
assert error < 1e-3
