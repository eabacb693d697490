"""Simulate a scene of your own.

The presets are the scenes of the paper. Any other one is a radar, objects, interfering radars with
channels of their own, and levels; or a frame that was measured, with bursts added to it.
"""

import numpy as np

import vsep

radar = vsep.ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=2e13,
    sample_rate_hz=10e6,
    ramp_period_s=30e-6,
    num_samples=200,
    num_ramps=16,
)
receiver = vsep.ButterworthFilter(cutoff_hz=3e6, order=6)

# Two objects: their delays are two-way, a growing distance has a positive Doppler frequency.
range_m, speed_mps = np.array([15.0, 21.0]), np.array([-3.0, 8.0])
objects = vsep.Channel(
    delays_s=2.0 * range_m / 299_792_458.0,
    dopplers_hz=2.0 * speed_mps * radar.start_frequency_hz / 299_792_458.0,
    weights=np.array([1.0, 0.5j]),
)

# Another radar, whose direct path and one echo cross the band in every ramp.
interferer = vsep.Interferer(
    sequence=vsep.InterfererSequence(
        start_frequency_hz=76.98e9,
        slope_hz_per_s=2.2e13,
        ramp_duration_s=29e-6,
        ramp_period_s=30.05e-6,
        num_ramps=16,
    ),
    channel=vsep.Channel(
        delays_s=np.array([0.0, 60e-9]), dopplers_hz=np.zeros(2), weights=np.array([1.0, 0.3j])
    ),
)
scene = vsep.Scene(objects=objects, interferers=(interferer,), snr_db=45.0, sir_db=-15.0)
observation = vsep.simulate(
    radar, scene, anti_aliasing_filter=receiver, rng=np.random.default_rng(5)
)

model = vsep.SignalModel.of_radar(radar, receiver)
solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)
found_m = np.sort(radar.range_from_beat(solution.objects.beats))
print(f"{len(observation.truth.bursts)} bursts; objects at {found_m.round(3)} m")

assert len(found_m) == 2
assert np.abs(found_m - range_m).max() < 0.02
