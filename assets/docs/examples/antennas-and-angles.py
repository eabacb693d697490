"""Several antennas and angles of arrival.

Antennas share the objects' places and the bursts' parameters; every antenna has weights of its own,
whose phases tell the direction. See [several receive antennas](../antennas.md).
"""

import numpy as np

import vsep
from vsep.analysis.angles import object_angles
from vsep.presets.antennas import simulate_preset_antennas
from vsep.signal.linear_array import UniformLinearArray

line = UniformLinearArray(num_antennas=4, spacing_wavelengths=0.5)
scenario, observation = simulate_preset_antennas(
    "simulation-1", line, snr_db=30.0, sir_db=-20.0, seed=3, object_angles_deg=np.array([25.0])
)
model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter, 4)
solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)

objects = solution.objects
angles = object_angles(
    objects.amplitudes, np.diagonal(objects.covariance).real, line.spacing_wavelengths
)
(angle_deg,), (std_deg,) = angles.angles_deg, angles.stds_deg
print(f"{scenario.radar.range_from_beat(objects.beats)[0]:.2f} m, {angle_deg:.2f} ± {std_deg:.2f}°")
assert abs(angle_deg - 25.0) < 4.0 * std_deg < 4.0
