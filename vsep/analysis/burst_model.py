"""Simulated interference in the form of model (9): bursts, channel lines and weights.

The simulator works with delays in seconds and with crossings of the band; (9) with chirp
parameters theta, lines of the interference channel and their weights beta. A path of delay tau is
a line of ``k_I tau / f_s`` cycles per sample.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.bursts import true_bursts
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Interferer
from vsep.signal.template import SignalModel
from vsep.signal.transmitters import chirp_parts


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Burst:
    """One burst with its channel."""

    ramp: int  #: in which ramp
    #: theta, in cycles per sample and cycles per sample squared
    start_frequency: float
    slope: float
    channel_frequencies: FloatArray  #: (K,) channel lines vartheta in cycles per sample
    amplitudes: ComplexArray  #: (K,) beta, weights of the lines ``exp(-j 2 pi vartheta n)``

    def lines(self, num_samples: int) -> ComplexArray:
        """(K, N) channel lines, not normalised."""
        cycles = np.outer(self.channel_frequencies, np.arange(num_samples))
        return np.asarray(np.exp(-2j * np.pi * cycles))


def model_bursts(
    radar: ChirpSequence,
    interferers: Sequence[Interferer],
    model: SignalModel,
    interference_signal: ComplexArray,
) -> tuple[Burst, ...]:
    """Write the interference of a simulated scene as (9) does.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    interferers : sequence of Interferer
        Those of the scene.
    model : SignalModel
        With the *true* filter.
    interference_signal : (P, N) complex
        What they made; the weights of all bursts of a ramp are fitted to it together, exactly for
        the multiplicative interference model.

    Returns
    -------
    tuple of Burst
        In the order of the ramps.
    """
    rate = radar.sample_rate_hz
    bursts = [
        Burst(
            ramp=burst.ramp,
            start_frequency=burst.start_frequency_hz / rate,
            slope=burst.slope_hz_per_s / rate**2,
            channel_frequencies=interferer.channel.delays_s
            * (interferer.sequence.slope_hz_per_s / rate),
            amplitudes=np.zeros(interferer.channel.num_paths, dtype=np.complex128),
        )
        for sender in interferers
        for interferer in chirp_parts(radar, sender, model.anti_aliasing_filter)
        for burst in true_bursts(radar, interferer.sequence, model.anti_aliasing_filter)
    ]
    ramps = sorted({burst.ramp for burst in bursts})
    return tuple(
        fitted
        for ramp in ramps
        for fitted in _fitted(
            [burst for burst in bursts if burst.ramp == ramp], model, interference_signal[ramp]
        )
    )


def burst_signal(bursts: Sequence[Burst], model: SignalModel) -> ComplexArray:
    """U Psi beta of all bursts, (P, N)."""
    signal = np.zeros(model.shape, dtype=np.complex128)
    for burst in bursts:
        signal[burst.ramp] += burst.amplitudes @ _columns(burst, model)
    return signal


def _fitted(bursts: Sequence[Burst], model: SignalModel, signal: ComplexArray) -> tuple[Burst, ...]:
    """Least-squares weights of the bursts of one ramp."""
    columns = np.concatenate([_columns(burst, model) for burst in bursts])
    weights = np.linalg.lstsq(columns.T, signal)[0]
    ends = np.cumsum([len(burst.channel_frequencies) for burst in bursts])[:-1]
    return tuple(
        replace(burst, amplitudes=part)
        for burst, part in zip(bursts, np.split(weights, ends), strict=True)
    )


def _columns(burst: Burst, model: SignalModel) -> ComplexArray:
    """(K, N) atoms u Gbar psi_k of one burst."""
    chirp = np.array([burst.start_frequency]), np.array([burst.slope])
    return np.asarray(model.template(*chirp) * burst.lines(model.num_samples))
