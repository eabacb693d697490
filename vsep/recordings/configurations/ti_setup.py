"""Chirp profiles of Texas Instruments' sensors, whichever of their tools wrote them.

A ramp lasts from the end of the idle time to the ramp's end; the next chirp's idle time follows.
Every chirp of a frame names a profile and the transmitters that send it.
"""

from dataclasses import dataclass, field

from vsep.errors import InputError
from vsep.recordings.configurations.configuration import ONE_CHIRP, Configuration, Said
from vsep.recordings.settings import COMPLEX_1X, COMPLEX_2X, REAL

FOUR_LANES = ("12", "14", "22", "1243", "1443", "2243")
_KINDS = {
    0: (REAL, "real"),
    1: (COMPLEX_1X, "Complex 1x"),
    2: (COMPLEX_2X, "Complex 2x"),
    3: (REAL, "pseudo real"),
}
_MOST_CHIRPS = 512


@dataclass(frozen=True, slots=True)
class Profile:
    """A profile in the units of the SI, and where it stands."""

    number: int
    start_frequency_hz: float
    idle_s: float
    adc_start_s: float
    ramp_end_s: float
    slope_hz_per_s: float
    num_samples: int
    sample_rate_hz: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TiProfile:
    """A profile in the units in which Texas Instruments' tools write it."""

    number: int
    start_frequency_ghz: float
    idle_us: float
    adc_start_us: float
    ramp_end_us: float
    slope_mhz_per_us: float
    num_samples: int
    sample_rate_ksps: float
    source: str

    def in_si(self) -> Profile:
        """Return the profile in the units of the SI."""
        return Profile(
            number=self.number,
            start_frequency_hz=self.start_frequency_ghz * 1e9,
            idle_s=self.idle_us * 1e-6,
            adc_start_s=self.adc_start_us * 1e-6,
            ramp_end_s=self.ramp_end_us * 1e-6,
            slope_hz_per_s=self.slope_mhz_per_us * 1e12,
            num_samples=self.num_samples,
            sample_rate_hz=self.sample_rate_ksps * 1e3,
            source=self.source,
        )


@dataclass(frozen=True, slots=True)
class Chirp:
    """Chirps from one index to another, which profile they have and which transmitters send."""

    first: int
    last: int
    profile: int
    transmitters: int


@dataclass(slots=True)
class TiSetup:
    """What a configuration says, as far as it was read; sources beside the values."""

    name: str
    profiles: dict[int, Profile] = field(default_factory=dict)
    chirps: list[Chirp] = field(default_factory=list)
    chirps_source: str = ""
    frame: tuple[int, int, int] | None = None  #: first chirp, last chirp, loops
    frame_source: str = ""
    frame_period_s: float = 0.0
    receivers: Said | None = None  #: mask
    sample_kind: Said | None = None  #: as in `_KINDS`
    device: Said | None = None  #: as its maker calls it, for example xWR18xx
    remarks: list[str] = field(default_factory=list)

    def configuration(self) -> Configuration:
        """Return the settings.

        Raises `InputError` if there is no profile, or it cannot be.
        """
        if not self.profiles:
            raise InputError(f"{self.name} holds no profile of a chirp; a radar's is needed.")
        order = self._order()
        profile = self._profile(order)
        settings: dict[str, Said] = {"format": self._format()}
        settings |= {
            "start_frequency_hz": Said(profile.start_frequency_hz, profile.source),
            "slope_hz_per_s": Said(profile.slope_hz_per_s, profile.source),
            "sample_rate_hz": Said(profile.sample_rate_hz, profile.source),
            "ramp_period_s": Said(
                profile.idle_s + profile.ramp_end_s,
                f"idle time {profile.idle_s * 1e6:g} us + ramp end {profile.ramp_end_s * 1e6:g} us "
                f"of {profile.source}",
            ),
            "adc_start_s": Said(profile.adc_start_s, profile.source),
            "num_samples": Said(profile.num_samples, profile.source),
        }
        if self.frame is not None:
            ramps = len(order) * self.frame[2]
            if ramps == 1 and self.frame_period_s > settings["ramp_period_s"].value:
                settings["ramp_period_s"] = Said(
                    self.frame_period_s,
                    f"one chirp a frame: the frame's period, {self.frame_source}",
                )
                self.remarks.append(ONE_CHIRP)
            else:
                settings["num_ramps"] = Said(
                    ramps, f"{len(order)} chirps in {self.frame[2]} loops of {self.frame_source}"
                )
        settings |= self._antennas(settings["format"].value, order)
        if self.sample_kind is not None:
            kind, text = _KINDS.get(int(self.sample_kind.value), ("complex", "unknown"))
            settings["samples"] = Said(kind, f"{text} by {self.sample_kind.source}")
        self._judge(profile, settings)
        return Configuration(settings, tuple(self.remarks))

    def _order(self) -> list[Chirp]:
        """Chirps of one loop in their order, one by one."""
        if self.frame is None:
            return self.chirps[:1]
        first, last, _ = self.frame
        if not 0 <= first <= last < _MOST_CHIRPS:
            raise InputError(
                f"{self.name}: the frame has chirps {first} to {last}; they must lie between 0 and "
                f"{_MOST_CHIRPS - 1}, the first before the last."
            )
        none = Chirp(0, 0, next(iter(self.profiles)), 0)
        of_index = {
            index: chirp
            for chirp in self.chirps
            for index in range(max(chirp.first, 0), min(chirp.last, _MOST_CHIRPS) + 1)
        }
        return [of_index.get(index, none) for index in range(first, last + 1)]

    def _profile(self, order: list[Chirp]) -> Profile:
        used = list(dict.fromkeys(chirp.profile for chirp in order)) or list(self.profiles)
        number = used[0] if used[0] in self.profiles else next(iter(self.profiles))
        if len(used) > 1:
            self.remarks.append(
                f"The frame's chirps have the profiles {', '.join(map(str, used[:8]))}; {number} "
                "is read, and all ramps are taken to have it."
            )
        return self.profiles[number]

    def _format(self) -> Said:
        if self.device is None:
            return Said(
                "dca1000-xwr16xx",
                "assumed: a DCA1000 with xWR16xx/18xx/68xx; the file names no device",
            )
        name = str(self.device.value).lower().replace("xwr", "").replace("awr", "")
        name = name.replace("iwr", "").replace("ar", "")
        four = name.startswith(FOUR_LANES)
        kind = "dca1000-xwr14xx" if four else "dca1000-xwr16xx"
        return Said(kind, f"a DCA1000 with {self.device.value}, {self.device.source}")

    def _antennas(self, kind: str, order: list[Chirp]) -> dict[str, Said]:
        found: dict[str, Said] = {}
        if self.receivers is not None:
            mask = int(self.receivers.value)
            on = [number for number in range(16) if mask >> number & 1]
            source = f"receivers {', '.join(str(number) for number in on)} by "
            source += self.receivers.source
            if kind == "dca1000-xwr14xx":
                found["num_antennas"] = Said(4, "four lanes, all of them in the file")
                if len(on) < 4:
                    found["antennas"] = Said(",".join(map(str, on)), source)
            else:
                found["num_antennas"] = Said(max(len(on), 1), source)
        masks = [chirp.transmitters for chirp in order]
        if len(set(masks)) > 1:
            found["num_transmitters"] = Said(
                len(masks),
                f"{len(masks)} chirps of a loop sent by other transmitters, {self.chirps_source}",
            )
            if any(mask & (mask - 1) for mask in masks):
                self.remarks.append(
                    "Some chirps are sent by several transmitters at once; each chirp of a loop is "
                    "taken for one transmitter's."
                )
        return found

    def _judge(self, profile: Profile, settings: dict[str, Said]) -> None:
        """Compare the times with each other."""
        if profile.sample_rate_hz <= 0.0:
            raise InputError(
                f"{self.name}: the sample rate is {profile.sample_rate_hz:g} Hz in "
                f"{profile.source}; it must be positive."
            )
        sampled_s = profile.adc_start_s + profile.num_samples / profile.sample_rate_hz
        if sampled_s > profile.ramp_end_s * (1.0 + 1e-9):
            self.remarks.append(
                f"The ramp ends after {profile.ramp_end_s * 1e6:g} us, but adc start and "
                f"{profile.num_samples} samples at {profile.sample_rate_hz / 1e6:g} MHz take "
                f"{sampled_s * 1e6:g} us: one of them is wrong in {profile.source}."
            )
        ramps_s = settings["ramp_period_s"].value * (
            settings["num_ramps"].value if "num_ramps" in settings else 0
        )
        if self.frame_period_s and ramps_s > self.frame_period_s:
            self.remarks.append(
                f"The ramps of a frame last {ramps_s * 1e3:g} ms, its period is "
                f"{self.frame_period_s * 1e3:g} ms: one of them is wrong."
            )
