"""Motion of objects from frame to frame by their Doppler frequencies."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vsep._validation import require_range
from vsep.parameters import PARAMETERS
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, ChirpSequence
from vsep.signal.scene import Channel, Scene

CYCLE_S = 0.05
"""From frame to frame; usual in cars."""


def moved_paths(radar: ChirpSequence, channel: Channel, elapsed_s: float) -> Channel:
    """Paths of an object channel after some time, at constant velocity.

    With the velocity v the Doppler frequency is 2 v f_0 / c and the delay grows by 2 v / c a
    second: by nu / f_0. The phase turns on as it does within a frame, by exp(-j 2 pi nu t).

    Parameters
    ----------
    radar : ChirpSequence
        Gives the carrier f_0.
    channel : Channel
        Two-way delays and Doppler frequencies.
    elapsed_s : float
        Time that passes.

    Examples
    --------
    >>> import numpy as np
    >>> from vsep.presets.scenes import preset_radar
    >>> channel = Channel(
    ...     delays_s=np.array([1e-7]), dopplers_hz=np.array([7.9e3]), weights=np.ones(1)
    ... )
    >>> moved_paths(preset_radar("simulation-2-a"), channel, 0.05).delays_s
    array([1.05e-07])
    """
    return replace(
        channel,
        delays_s=channel.delays_s + channel.dopplers_hz * (elapsed_s / radar.start_frequency_hz),
        weights=channel.weights * np.exp(-2j * np.pi * channel.dopplers_hz * elapsed_s),
    )


def accelerated(
    rng: np.random.Generator, radar: ChirpSequence, channel: Channel, acceleration_mps2: float
) -> Channel:
    """Let every object gain or lose velocity by an acceleration; which, is drawn."""
    PARAMETERS["object_acceleration"].require(acceleration_mps2)
    rate = 2.0 * acceleration_mps2 * radar.start_frequency_hz / SPEED_OF_LIGHT_MPS
    signs = rng.choice([-1.0, 1.0], channel.num_paths)
    return replace(channel, doppler_rates_hz_per_s=rate * signs)


def moving_scenes(
    radar: ChirpSequence, scene: Scene, num_frames: int, *, cycle_s: float = CYCLE_S
) -> Iterator[Scene]:
    """Yield the scene of every measurement cycle; the first is the scene itself.

    Parameters
    ----------
    radar : ChirpSequence
        The victim.
    scene : Scene
        Objects at the start; interferers and levels stay.
    num_frames : int
        How many scenes.
    cycle_s : float
        From frame to frame.

    Raises
    ------
    InputError
        If a number is out of its range.
    """
    require_range("num_frames", num_frames, 1, 1_000_000)
    require_range("cycle_s", cycle_s, 0.0, 1e3, "s")
    for index in range(num_frames):
        yield replace(scene, objects=moved_paths(radar, scene.objects, index * cycle_s))
