"""The Cramér-Rao bound of a scene.

No unbiased estimator has smaller deviations. The bound is evaluated twice: with the interference
known, and with the parameters and weights of every burst unknown too; the difference is the price
of not knowing it. One object in one ramp has a closed form.
"""

import numpy as np

import vsep
from vsep.analysis.burst_model import model_bursts
from vsep.analysis.crlb import dispersion_bound, single_line_bound

scenario, observation = vsep.simulate_preset("simulation-1", snr_db=30.0, sir_db=-20.0, seed=3)
radar, truth = scenario.radar, observation.truth
model = vsep.SignalModel.of_radar(radar, scenario.anti_aliasing_filter)

bursts = model_bursts(radar, scenario.scene.interferers, model, truth.interference_signal)
known = dispersion_bound(truth, model)
unknown = dispersion_bound(truth, model, bursts)
closed_form = single_line_bound(1e3, radar.num_samples)


def in_mm(beat_std: float) -> float:
    """Deviation of a range for that of a beat frequency."""
    return 1e3 * abs(float(radar.range_from_beat(beat_std)))


print(f"closed form            {in_mm(closed_form):.3f} mm")
print(f"interference known     {in_mm(known.beats[0]):.3f} mm")
print(f"interference unknown   {in_mm(unknown.beats[0]):.3f} mm")

solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)
error_mm = in_mm(solution.objects.beats[0] - truth.beats[0])
print(f"error of this estimate {error_mm:.3f} mm")

assert np.isclose(known.beats[0], closed_form, rtol=1e-6)
assert unknown.beats[0] >= known.beats[0]
assert error_mm < 4.0 * in_mm(unknown.beats[0])  # four deviations: once in 16 000 frames
