"""The interfering radar as a whole: its timing.

All bursts of one interferer follow from its slope, its chirp interval and one offset. Fitted to the
bursts that a separation found, they tell the other radar's slope and interval exactly, and where it
must have sent bursts that were too weak to be found. See
[recordings](../recordings.md#the-interferer-as-a-whole).
"""

import numpy as np

import vsep
from vsep.analysis.interferer_timing import fit_interferer_timings
from vsep.two_pass import crossings_of

radar = vsep.ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=30e12,
    sample_rate_hz=10e6,
    ramp_period_s=30e-6,
    num_samples=256,
    num_ramps=48,
)
receiver = vsep.RaisedCosineFilter(cutoff_hz=2.5e6, rolloff=0.25)
interferer = vsep.InterfererSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=12e12,
    ramp_duration_s=60e-6,
    ramp_period_s=71.3e-6,
    num_ramps=24,
    time_offset_s=-20e-6,
)
path = vsep.Channel(
    delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, dtype=complex)
)
scene = vsep.Scene(
    objects=vsep.Channel(
        delays_s=np.array([80e-9]), dopplers_hz=np.zeros(1), weights=np.ones(1, dtype=complex)
    ),
    interferers=(vsep.Interferer(sequence=interferer, channel=path),),
    snr_db=45.0,
    sir_db=-15.0,
)
observation = vsep.simulate(
    radar, scene, anti_aliasing_filter=receiver, rng=np.random.default_rng(2)
)

model = vsep.SignalModel.of_radar(radar, receiver)
solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)
(timing,) = fit_interferer_timings(crossings_of(solution.state.bursts, radar), radar)
print(
    f"{len(timing.chirps)} bursts: slope {timing.slope_hz_per_s / 1e12:.4f} MHz/µs, a chirp every "
    f"{timing.ramp_period_s * 1e6:.4f} µs, residual {timing.median_residual:.3f} samples"
)
assert abs(timing.slope_hz_per_s / 12e12 - 1.0) < 1e-3
assert abs(timing.ramp_period_s / 71.3e-6 - 1.0) < 1e-3
