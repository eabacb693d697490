"""What the tests of repair share: frames of Simulation II with bursts in chosen places."""

from typing import NamedTuple

import numpy as np

from vsep.presets.scenes import simulate_preset

SETS = ("simulation-2-a", "simulation-2-b", "simulation-2-c")


class RepairScene(NamedTuple):
    """A frame, its parts (P, N), the perfect mask and what simulated it."""

    radar: object
    received: np.ndarray
    objects: np.ndarray
    mask: np.ndarray
    observation: object


def repair_scene(index, *, snr_db=60.0, sir_db=-20.0, shift=0, tails=True):
    """Frame `index`, the three sets in turn, its bursts rolled by `shift` ramps.

    Without `tails` every burst is cut where its frequency leaves the filter's pass band, and the
    mask is what is left: a tenth of the frame, as in the source's figures. The bursts as simulated
    have Fresnel tails, which at SIR -20 dB rise above the noise over a fifth of the frame.
    """
    scenario, observation = simulate_preset(
        SETS[index % 3], snr_db=snr_db, sir_db=sir_db, seed=1000 + index
    )
    truth = observation.truth
    interference = truth.interference_signal
    mask = truth.perfect_mask()
    if not tails:
        mask = _pass_band(scenario, truth)
        interference = np.where(mask, interference, 0.0)
    received = observation.received - truth.interference_signal
    received = received + np.roll(interference, shift, axis=0)
    return RepairScene(
        scenario.radar, received, truth.object_signal, np.roll(mask, shift, axis=0), observation
    )


def _pass_band(scenario, truth):
    """(P, N) True where a burst's frequency lies inside the raised cosine's support."""
    radar, response = scenario.radar, scenario.anti_aliasing_filter
    mask = np.zeros(radar.shape, dtype=bool)
    time_s = np.arange(radar.num_samples) / radar.sample_rate_hz
    for burst in truth.bursts:
        frequency_hz = burst.start_frequency_hz + burst.slope_hz_per_s * time_s
        mask[burst.ramp] |= np.abs(frequency_hz) < response.cutoff_hz * (1.0 + response.rolloff)
    return mask
