"""Add bursts to a measured frame.

A real frame ships with the program: one person walking in a room, recorded without interference.
Bursts of another radar are added to it at a level of choice, so that what a separation leaves of
them is known. Needs `pip install 'vsep[dashboard]'`, which brings the frame.
"""

import numpy as np
from vsep_app import assets

import vsep

frame = vsep.read_frame(assets.path("frames/openradar_doppler_example_1.npz"))
radar = frame.radar
other = vsep.Interferer(
    sequence=vsep.InterfererSequence(
        start_frequency_hz=radar.start_frequency_hz - 2e8,
        slope_hz_per_s=radar.slope_hz_per_s + 1e13,
        ramp_duration_s=60e-6,
        ramp_period_s=1.5 * radar.ramp_period_s,
        num_ramps=64,
    ),
    channel=vsep.Channel(
        delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, dtype=complex)
    ),
)
disturbed = vsep.add_interference(
    radar, frame.received, [other], sir_db=-10.0, anti_aliasing_filter=frame.assumed_filter
)
model = vsep.SignalModel.of_radar(radar, frame.assumed_filter)
separator = vsep.FactorisedSeparator(model=model, max_iterations=20)
solution = vsep.run(separator, disturbed.received)

bursts = disturbed.truth.interference_signal
error = solution.state.interference_signal - bursts
left_db = 10 * np.log10(np.vdot(error, error).real / np.vdot(bursts, bursts).real)
found = set(solution.state.interfered_ramps)
print(f"{len(disturbed.truth.bursts)} bursts added, {len(found)} found, {left_db:.1f} dB left")
assert found == {burst.ramp for burst in disturbed.truth.bursts}
assert left_db < -15.0
