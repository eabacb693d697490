"""Noise spectrum of a state, estimated anew as long as a run has not settled."""

import math
from collections.abc import Sequence

import numpy as np

from vsep._typing import ComplexArray, IntArray
from vsep.inference.core.noise_spectrum import (
    CONVINCING,
    STILL_CONVINCING,
    NoiseSpectrum,
    estimate_noise_spectrum,
)
from vsep.inference.core.progress import ComponentEvent, EventKind
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.template import SignalModel

NEARLY_NOISE_DB = 13.0  # over the threshold: what the strongest unmodelled line may have
QUIETER = 0.5  # times 1/lambda: the ramps without bursts are quieter where bursts raise lambda
STEADY = 0.1  # relative change of lambda in a step: by more, and sources are still unmodelled
EVERY_FIRST = 4  # iterations in which the spectrum is estimated each time, then every second time
LAST_ESTIMATE = 24  # iteration after which the spectrum stands still, so that a run can settle


def noise_spectrum_due(state: SeparationState) -> bool:
    """Whether the noise spectrum is looked at in the step that starts from a state."""
    early = state.iteration < EVERY_FIRST
    return early or (state.iteration % 2 == 0 and state.iteration <= LAST_ESTIMATE)


def next_noise_spectrum(
    state: SeparationState,
    objects: ObjectComponents,
    events: Sequence[ComponentEvent],
    noise_residual: ComplexArray,
    noise_precision: float,
    model: SignalModel,
    *,
    interfered: IntArray | None = None,
    share: float = 1.0,
) -> NoiseSpectrum | None:
    """Noise spectrum after a step: estimated anew as long as what is left is nearly noise.

    Parameters
    ----------
    state : SeparationState
        Where the step started from.
    objects : ObjectComponents
        After the step; what the own oscillator's noise is in proportion to.
    events : sequence of ComponentEvent
        Of the step; they say how strong the strongest unmodelled line was.
    noise_residual : (A P, N) complex
        What objects and bursts leave, zero where a sample does not count.
    noise_precision : float
        lambda after the step.
    model : SignalModel
        Sampling and assumed filter.
    interfered : (B,) int, optional
        Rows of which a part does not count or is explained by bursts.
    share : float
        Of the frame's noise that is left in the residual.
    """
    strongest = max(
        (
            event.snr_db - event.threshold_db
            for event in events
            if event.kind in (EventKind.OBJECT_ADDED, EventKind.OBJECT_REJECTED)
        ),
        default=0.0,
    )
    moving = abs(noise_precision / state.noise_precision - 1.0) > STEADY
    if moving or strongest > NEARLY_NOISE_DB:
        return state.noise_spectrum
    rows = noise_residual.reshape(model.num_antennas, *model.shape)
    clean = np.ones(model.num_ramps, np.bool_)
    if interfered is not None:
        clean[interfered % model.num_ramps] = False
    if 2 * np.count_nonzero(clean) >= model.num_ramps:
        if not clean.all():
            rows = rows[:, clean]
            # Beside a lambda that holds bursts lines look weak: these ramps may be full of them.
            if noise_precision * float(np.mean(np.abs(rows) ** 2)) < QUIETER:
                return None
    else:
        rows = rows / np.sqrt(share)
    last = state.noise_spectrum
    convincing = CONVINCING if last is None else STILL_CONVINCING
    lines = objects.beats, objects.powers / math.prod(model.shape)
    spectrum = estimate_noise_spectrum(rows, model, convincing=convincing, lines=lines)
    # A run cannot settle while its thresholds move.
    settled = last is not None and spectrum is not None and not spectrum.differs_from(last)
    return last if settled else spectrum
