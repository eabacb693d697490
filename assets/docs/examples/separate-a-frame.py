"""Separate a frame.

Simulation II of the paper: ten objects under the bursts of another radar. The estimator is told
neither how many objects there are nor where the bursts lie.
"""

import numpy as np

import vsep
from vsep.analysis.metrics import frame_errors

scenario, observation = vsep.simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=7)
radar = scenario.radar

model = vsep.SignalModel.of_radar(radar, scenario.anti_aliasing_filter)
separator = vsep.FactorisedSeparator(model=model, false_alarm_rate=0.05)
solution = vsep.run(separator, observation.received)

deviations = vsep.state_deviations(solution.state, radar.shape)
ranges_m = radar.range_from_beat(solution.objects.beats)
speeds_mps = radar.velocity_from_doppler(solution.objects.dopplers)
for range_m, speed_mps, beat_std in zip(ranges_m, speeds_mps, deviations.beats, strict=True):
    deviation_mm = 1e3 * abs(radar.range_from_beat(beat_std))
    print(f"{range_m:7.3f} m ± {deviation_mm:.1f} mm, {speed_mps:6.2f} m/s")
print(f"bursts in the ramps {solution.state.interfered_ramps}: {solution.termination.value}")

# The truth of a simulation says what was missed, within one resolution cell.
truth = observation.truth
errors = frame_errors(
    np.stack([truth.beats, truth.dopplers], axis=1),
    np.stack([solution.objects.beats, solution.objects.dopplers], axis=1),
    radar.shape,
)
print(f"{errors.misses} misses, {errors.false_alarms} false alarms")
assert errors.misses <= 1
assert errors.false_alarms <= 1
assert set(solution.state.interfered_ramps) == {burst.ramp for burst in truth.bursts}
