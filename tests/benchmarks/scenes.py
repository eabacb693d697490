"""Frames of any size for the benchmarks, made of the estimator's own model."""

from dataclasses import dataclass

import numpy as np

from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import simulate_preset
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel

SAMPLE_RATE_HZ = 5.1e6
BURST_SHARE = 0.25  # of a ramp
CHANNEL_PATHS = 5
# Energies of the frame over the noise power of a sample, as in Simulation II.
OBJECT_SNR_DB = 60.0
SIR_DB = -20.0


@dataclass(frozen=True)
class Problem:
    """A frame and the separator for it."""

    separator: FactorisedSeparator
    received: np.ndarray


def preset_problem(name, snr_db, sir_db, seed=1):
    """A frame of the paper's simulations."""
    scenario, observation = simulate_preset(name, snr_db=snr_db, sir_db=sir_db, seed=seed)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    return Problem(FactorisedSeparator(model=model), observation.received)


def with_energy(signal, energy):
    """The same signal with another energy."""
    return signal * np.sqrt(energy / np.sum(np.abs(signal) ** 2))


def drawn_problem(shape, num_objects, num_bursts, seed=1, *, noise_seed=None, clean=False):
    """Objects at random places, bursts with five paths each in the first ramps, unit noise.

    Another `noise_seed` draws other noise; a clean frame is the same without its bursts.
    """
    num_ramps, num_samples = shape
    rng = np.random.default_rng(seed)
    model = SignalModel(
        num_ramps=num_ramps,
        num_samples=num_samples,
        sample_rate_hz=SAMPLE_RATE_HZ,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=SAMPLE_RATE_HZ / 4, rolloff=0.25),
    )
    beats, dopplers = rng.uniform(0.0, 0.45, num_objects), rng.uniform(-0.5, 0.5, num_objects)
    weights = 10 ** rng.uniform(-0.5, 0.0, num_objects) * np.exp(
        2j * np.pi * rng.random(num_objects)
    )
    factors = line_factors(beats, num_samples), line_factors(dopplers, num_ramps)
    objects = with_energy(synthesize(weights, *factors), 10 ** (OBJECT_SNR_DB / 10))
    slopes = 2.0 * model.normalised_cutoff / (BURST_SHARE * num_samples)
    slopes *= rng.uniform(0.7, 1.4, num_bursts) * rng.choice([-1.0, 1.0], num_bursts)
    centres = rng.uniform(0.2, 0.8, num_bursts) * num_samples
    bursts = np.zeros(shape, dtype=complex)
    for p, template in enumerate(model.template(-slopes * centres, slopes)):
        delays = np.append(0.0, rng.uniform(0.0, 8.0, CHANNEL_PATHS - 1)) / num_samples
        gains = np.append(1.0, rng.uniform(0.05, 0.3, CHANNEL_PATHS - 1))
        bursts[p] = template * (gains @ line_factors(delays, num_samples))
    bursts = with_energy(bursts, 10 ** ((OBJECT_SNR_DB - SIR_DB) / 10))
    if noise_seed is not None:
        rng = np.random.default_rng(noise_seed)
    if clean:
        bursts[:] = 0.0
    noise = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    return Problem(FactorisedSeparator(model=model), objects + bursts + noise)
