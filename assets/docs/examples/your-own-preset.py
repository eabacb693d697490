"""Add a preset of your own.

A preset is one record: radar, interfering radar, what is drawn at random, usual levels and ranges.
It goes to `vsep.simulate_preset` as it stands. [Extending](../extending.md) says how a package of
yours brings it to the command line, the forms and the addresses of the dashboard.
"""

import numpy as np

import vsep
from vsep.presets.channels import direct_path
from vsep.presets.record import SimulatedPreset

SPEED_OF_LIGHT_MPS = 299_792_458.0


def draw_parked_cars(rng: np.random.Generator, num_objects: int | None) -> vsep.Channel:
    """Draw cars at rest between 3 and 15 m, all equally strong."""
    count = 4 if num_objects is None else num_objects
    slots_m = 3.0 + 3.0 * np.arange(count)
    range_m = slots_m + rng.uniform(-0.5, 0.5, count)
    return vsep.Channel(
        delays_s=2.0 * range_m / SPEED_OF_LIGHT_MPS,
        dopplers_hz=np.zeros(count),
        weights=np.exp(2j * np.pi * rng.random(count)),
    )


PRESET = SimulatedPreset(
    name="car-park",
    label="Car park: four cars at rest",
    help="Four cars at rest under the bursts of a radar that leaves.",
    radar=vsep.ChirpSequence(
        start_frequency_hz=77e9,
        slope_hz_per_s=2e13,
        sample_rate_hz=8e6,
        ramp_period_s=30e-6,
        num_samples=192,
        num_ramps=8,
    ),
    interferer=vsep.InterfererSequence(
        start_frequency_hz=76.98e9,
        slope_hz_per_s=2.15e13,
        ramp_duration_s=29e-6,
        ramp_period_s=60.02e-6,
        num_ramps=4,
    ),
    draw_objects=draw_parked_cars,
    draw_paths=direct_path,
    num_objects=4,
    snr_db=45.0,
    slope_range_hz_per_s=(1.8e13, 2.2e13),
    cutoff_range_hz=(0.8e6, 4e6),
    shift_range_s=(-10e-6, 10e-6),
)

if __name__ == "__main__":
    scenario, observation = vsep.simulate_preset(PRESET, snr_db=45.0, sir_db=-20.0, seed=3)
    model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    solution = vsep.run(vsep.FactorisedSeparator(model=model), observation.received)

    true_m = np.sort(scenario.radar.range_from_beat(observation.truth.beats))
    found_m = np.sort(scenario.radar.range_from_beat(solution.objects.beats))
    print(f"cars at {true_m.round(2)} m, found at {found_m.round(2)} m")
    assert len(found_m) == 4
    assert np.abs(found_m - true_m).max() < 0.05
