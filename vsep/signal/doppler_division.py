"""Doppler-division MIMO: all transmitters send in every ramp, each with a phase step of its own.

Transmitter t turns its phase from ramp to ramp so that an object is seen at its own Doppler
frequency plus t / K, with the weights of the paths from each of T transmitters. With K > T one of
the K bands stays empty, and which one tells the object's own Doppler frequency.
"""

from dataclasses import dataclass, replace

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.errors import InputError, shown
from vsep.parameters import PARAMETERS
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.radar import ChirpSequence
from vsep.signal.scene import Channel

ONE = PARAMETERS["doppler_division"].default


@dataclass(frozen=True, kw_only=True, slots=True)
class DopplerDivision:
    """Phase steps of the transmitters.

    Parameters
    ----------
    num_transmitters : int
        T.
    num_bands : int
        K, one more than transmitters at least; negative where Doppler frequencies step down.

    Examples
    --------
    >>> DopplerDivision(num_transmitters=2, num_bands=4).offsets
    array([0.  , 0.25])
    """

    num_transmitters: int
    num_bands: int

    def __post_init__(self) -> None:
        """Check the numbers."""
        require_range("num_transmitters", self.num_transmitters, 1, 64)
        require_range("abs(num_bands)", abs(self.num_bands), self.num_transmitters + 1, 128)

    def __str__(self) -> str:
        """Return the text that `parse_doppler_division` reads."""
        return f"{self.num_transmitters}/{self.num_bands}"

    @property
    def offsets(self) -> FloatArray:
        """(T,) Doppler frequencies of the transmitters, cycles per ramp."""
        return np.arange(self.num_transmitters) / self.num_bands


def parse_doppler_division(text: str) -> DopplerDivision:
    """Return what a text like ``2/3`` says: transmitters, and bands.

    Raises `InputError` for any other.

    Examples
    --------
    >>> parse_doppler_division("2/3")
    DopplerDivision(num_transmitters=2, num_bands=3)
    """
    try:
        transmitters, bands = (int(part) for part in text.split("/"))
    except ValueError:
        raise InputError(
            f"The Doppler division is {shown(text)}; it is the number of transmitters and that of "
            "bands, as in 2/3."
        ) from None
    return DopplerDivision(num_transmitters=transmitters, num_bands=bands)


def known_division(text: str) -> DopplerDivision | None:
    """Return what a choice of `vsep.parameters.DOPPLER_DIVISIONS` says; None of one transmitter."""
    return None if text == ONE else parse_doppler_division(text)


def divided_channel(
    channel: Channel, radar: ChirpSequence, waveform: DopplerDivision, steering: ComplexArray
) -> Channel:
    """Return a channel with a line for every object and transmitter.

    Parameters
    ----------
    channel : Channel
        The objects, of the first transmitter.
    radar : ChirpSequence
        The victim.
    waveform : DopplerDivision
        The transmitters.
    steering : (L, T) complex
        Weights of the transmitters to that of the first.

    Raises
    ------
    InputError
        If start times of the ramps are dithered.
    """
    if any(radar.start_times_s):
        raise InputError(
            "Phases of the transmitters step from ramp to ramp, and start times of the ramps are "
            "dithered; with Doppler division ramps must start at equal times."
        )
    count = waveform.num_transmitters
    offsets_hz = np.repeat(waveform.offsets / radar.ramp_period_s, channel.num_paths)
    rates = channel.doppler_rates_hz_per_s
    return replace(
        channel,
        delays_s=np.tile(channel.delays_s, count),
        dopplers_hz=np.tile(channel.dopplers_hz, count) + offsets_hz,
        weights=(channel.weights[:, None] * steering).T.ravel(),
        groups=None if channel.groups is None else np.tile(channel.groups, count),
        doppler_rates_hz_per_s=None if rates is None else np.tile(rates, count),
    )


def divided_scene(
    antenna_scene: AntennaScene, radar: ChirpSequence, waveform: DopplerDivision
) -> AntennaScene:
    """Return a scene with a line for every object and transmitter, as `simulate_antennas` takes it.

    Transmitters stand as far apart as all receivers together, so that weights, transmitter by
    transmitter, are those of a line of T A antennas. Lines of the first transmitter come first.

    Parameters
    ----------
    antenna_scene : AntennaScene
        As the receivers see it with the first transmitter alone.
    radar : ChirpSequence
        The victim.
    waveform : DopplerDivision
        The transmitters.
    """
    objects, antennas = antenna_scene.scene.objects, antenna_scene.antennas
    spacing = antennas.num_antennas * antennas.spacing_wavelengths
    transmitters = UniformLinearArray(
        num_antennas=waveform.num_transmitters, spacing_wavelengths=spacing
    )
    steering = transmitters.steering(antenna_scene.object_angles_deg)
    lines = divided_channel(objects, radar, waveform, steering)
    return replace(
        antenna_scene,
        scene=replace(antenna_scene.scene, objects=lines),
        object_angles_deg=np.tile(antenna_scene.object_angles_deg, waveform.num_transmitters),
    )
