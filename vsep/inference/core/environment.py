"""Noise and receiver of a state, renewed at the end of a step."""

from dataclasses import replace

from vsep._typing import ComplexArray, IntArray
from vsep.inference.core.noise_update import next_noise_spectrum, noise_spectrum_due
from vsep.inference.core.progress import ComponentEvent, EventKind, IterationInfo
from vsep.inference.core.receiver_update import next_receiver_errors
from vsep.inference.core.state import SeparationState
from vsep.signal.template import SignalModel


def with_environment(
    state: SeparationState,
    new_state: SeparationState,
    info: IterationInfo,
    noise_residual: ComplexArray,
    model: SignalModel,
    *,
    noise_precision: float | None = None,
    interfered: IntArray | None = None,
    share: float = 1.0,
) -> tuple[SeparationState, IterationInfo]:
    """Return state and diagnostics of a step with noise spectrum and errors of the receiver.

    Parameters
    ----------
    state, new_state : SeparationState
        Where the step started from, and what it has led to.
    info : IterationInfo
        Of the step.
    noise_residual : (A P, N) complex
        What objects and bursts leave, zero where a sample does not count.
    model : SignalModel
        Sampling and assumed filter.
    noise_precision : float, optional
        lambda by which to tell whether sources are still unmodelled; that of the new state.
    interfered : (B,) int, optional
        Rows of which a part does not count or is explained by bursts.
    share : float
        Of the frame's noise that is left in the residual.
    """
    if not noise_spectrum_due(state):
        return new_state, info
    spectrum = next_noise_spectrum(
        state,
        new_state.objects,
        info.events,
        noise_residual,
        new_state.noise_precision if noise_precision is None else noise_precision,
        model,
        interfered=interfered,
        share=share,
    )
    receiver = next_receiver_errors(
        state,
        new_state.objects,
        new_state.object_signal,
        noise_residual,
        new_state.noise_precision,
        model,
    )
    if receiver is not state.receiver:  # a run cannot settle while its frame changes
        event = ComponentEvent(kind=EventKind.RECEIVER_CHANGED, snr_db=0.0, threshold_db=0.0)
        info = replace(info, events=(*info.events, event))
    elif spectrum is state.noise_spectrum:
        return new_state, info
    return replace(new_state, noise_spectrum=spectrum, receiver=receiver), info
