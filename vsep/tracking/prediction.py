"""Objects and bursts that a separated frame predicts for the next one."""

from dataclasses import replace

import numpy as np

from vsep._typing import FloatArray
from vsep.inference.core.state import ObjectComponents, SeparationState
from vsep.signal.motion import moved_paths
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel
from vsep.units import wrap_frequency

CHANGED = 4.0  # deviations of a Doppler frequency: what its change must be to go on


def moved_beats(
    beats: FloatArray, dopplers: FloatArray, radar: ChirpSequence, elapsed_s: float
) -> FloatArray:
    """Beat frequencies (L,) after some time, by the Doppler frequencies (L,) alone.

    Parameters
    ----------
    beats, dopplers : (L,) float
        Normalised frequencies.
    radar : ChirpSequence
        Gives slope, carrier and ramp period.
    elapsed_s : float
        Time that passes.

    Examples
    --------
    A receding object of 10 m/s is half a metre further after 50 ms.

    >>> from vsep.presets.scenes import preset_radar
    >>> radar = preset_radar("simulation-2-a")
    >>> doppler = 10.0 * 2.0 * radar.start_frequency_hz / 299_792_458.0 * radar.ramp_period_s
    >>> moved = moved_beats(np.array([0.1]), np.array([doppler]), radar, 0.05)
    >>> np.round(radar.range_from_beat(moved) - radar.range_from_beat(np.array([0.1])), 6)
    array([0.5])
    """
    channel = Channel(
        delays_s=radar.delay_from_beat(beats),
        dopplers_hz=radar.doppler_to_hz(dopplers),
        weights=np.ones(len(beats), dtype=np.complex128),
    )
    moved = moved_paths(radar, channel, elapsed_s)
    return wrap_frequency(radar.beat_from_delay(moved.delays_s))


def predicted_objects(
    objects: ObjectComponents,
    before: ObjectComponents | None,
    radar: ChirpSequence,
    elapsed_s: float,
) -> ObjectComponents:
    """Objects where they are after some time.

    A passing car may change its radial velocity by more than a resolution cell from frame to frame;
    it goes on changing it by as much. One whose change is not known yet changes it by its
    curvature.

    Parameters
    ----------
    objects : ObjectComponents
        Of the last frame.
    before : ObjectComponents or None
        Of the frame as long before that one as the next comes after it.
    radar : ChirpSequence
        The victim.
    elapsed_s : float
        Time that passes.
    """
    change = np.zeros(objects.num_components)
    if before is not None:
        _, own, earlier = np.intersect1d(
            objects.component_ids, before.component_ids, return_indices=True
        )
        change[own] = wrap_frequency(objects.dopplers[own] - before.dopplers[earlier])
        # Deviation of a frequency of an isolated line; what is less than noise is none.
        deviation = np.sqrt(6.0 / np.maximum(objects.component_snr, 1.0)) / (2.0 * np.pi)
        change[np.abs(change) * radar.num_ramps < CHANGED * deviation] = 0.0
    if objects.curvatures is not None:
        # Of one that accelerated in the last frame only this tells.
        bent = (objects.curvatures != 0.0) & (change == 0.0)
        elapsed_ramps = elapsed_s / radar.ramp_period_s
        change[bent] = 2.0 * objects.curvatures[bent] * elapsed_ramps
    # on the way the mean of both velocities counts
    beats = moved_beats(objects.beats, objects.dopplers + 0.5 * change, radar, elapsed_s)
    return replace(objects, beats=beats, dopplers=wrap_frequency(objects.dopplers + change))


def predicted_state(
    state: SeparationState,
    radar: ChirpSequence,
    elapsed_s: float,
    before: ObjectComponents | None = None,
) -> SeparationState:
    """State that the next frame starts from: iteration 0, objects moved, no burst.

    What the sources were like is kept: prior precisions, noise level and spectrum, the correction
    of the filter. The phases of the objects are not known and neither are the bursts' places; both
    follow from the frame.

    Parameters
    ----------
    state : SeparationState
        The end of the last frame.
    radar : ChirpSequence
        The victim.
    elapsed_s : float
        From the last frame to this one.
    before : ObjectComponents, optional
        See `predicted_objects`.
    """
    nothing = np.zeros(state.object_signal.shape, dtype=np.complex128)
    return SeparationState(
        iteration=0,
        objects=predicted_objects(state.objects, before, radar, elapsed_s),
        bursts=(),
        noise_precision=state.noise_precision,
        object_signal=nothing,
        interference_signal=nothing,
        next_component_id=state.next_component_id,
        filter_correction=state.filter_correction,
        noise_spectrum=state.noise_spectrum,
    )
