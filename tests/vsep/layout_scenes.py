"""Raw captures of eight layouts and three scenes, made from exact delays.

As a script it writes the figure and the table of `assets/docs/recordings.md`:

    python tests/vsep/layout_scenes.py assets/pictures/layouts.png
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

LAYOUT_SETTINGS = ("format", "samples", "num_samples", "num_antennas", "num_transmitters")
LIGHT = 299792458.0
START_HZ, SLOPE = 77e9, 30e12


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What a guess must find."""

    format: str
    samples: str
    num_antennas: int
    num_transmitters: int
    num_samples: int
    num_ramps: int  #: of all transmitters

    @property
    def settings(self) -> tuple[Any, ...]:
        """The settings that are compared, in the order of a guess."""
        return (
            self.format,
            self.samples,
            self.num_samples,
            self.num_antennas,
            self.num_transmitters,
        )


def _of(form: str, samples: str, antennas: int, transmitters: int, *counts: int) -> Layout:
    return Layout(
        format=form,
        samples=samples,
        num_antennas=antennas,
        num_transmitters=transmitters,
        num_samples=counts[0],
        num_ramps=counts[1],
    )


LAYOUTS = (
    _of("dca1000-xwr14xx", "complex-1x", 4, 1, 128, 64),
    _of("dca1000-xwr14xx", "real", 4, 1, 256, 64),
    _of("dca1000-xwr16xx", "complex-1x", 4, 1, 200, 64),
    _of("dca1000-xwr16xx", "complex-2x", 4, 2, 128, 64),
    _of("dca1000-xwr16xx", "real", 4, 1, 240, 64),
    _of("tda2", "complex-2x", 4, 3, 96, 96),
    _of("tsw1400", "complex-1x", 4, 1, 256, 32),
    _of("tsw1400-xwr16xx", "complex-2x", 2, 1, 256, 64),
)
SCENES = ("clutter", "interfered", "weak")


def capture(layout: Layout, scene: str, rng: np.random.Generator, num_frames: int = 1) -> bytes:
    """A capture file of a scene: static clutter, with bursts of another radar, or weak echoes."""
    ideal = samples_of(layout, scene, rng, num_frames)
    return words_of(layout, ideal).tobytes()


def samples_of(layout: Layout, scene: str, rng: np.random.Generator, num_frames: int = 1) -> Any:
    """Samples (ramps, antennas, samples) in least significant bits, not yet rounded.

    Frames come every 40 ms.
    """
    if num_frames > 1:
        whole = replace(layout, num_ramps=num_frames * layout.num_ramps)
        return samples_of_ramps(whole, scene, rng, layout.num_ramps)
    return samples_of_ramps(layout, scene, rng, layout.num_ramps)


def samples_of_ramps(layout: Layout, scene: str, rng: np.random.Generator, in_frame: int) -> Any:
    """Samples of ramps, so many in a frame."""
    rate = 10e6
    period = layout.num_samples / rate + 12e-6
    ramp, antenna, time = np.ogrid[: layout.num_ramps, : layout.num_antennas, : layout.num_samples]
    time_s = time / rate
    starts_s = period * (ramp % in_frame) + 40e-3 * (ramp // in_frame)
    transmitter = ramp % layout.num_transmitters
    # Beats reach half the rate, or all of it for Complex 1x
    reach_m = rate * LIGHT / (2.0 * SLOPE) * (0.95 if layout.samples == "complex-1x" else 0.47)
    num_still, num_moving = {"clutter": (12, 3), "interfered": (6, 3), "weak": (2, 2)}[scene]
    ranges = np.concatenate([rng.uniform(0.04, 1.0, num_still), rng.uniform(0.1, 1.0, num_moving)])
    velocities = np.concatenate([np.zeros(num_still), rng.uniform(-15.0, 15.0, num_moving)])
    # Complex 1x shows itself by echoes beyond half the rate
    ranges[0] = 0.8 if layout.samples == "complex-1x" else ranges[0]
    size = 40.0 if scene == "weak" else 600.0
    phases = np.exp(2j * np.pi * rng.uniform(-0.12, 0.12, layout.num_antennas))[None, :, None]
    gains = rng.uniform(0.8, 1.2, layout.num_antennas)[None, :, None]
    samples = np.zeros((layout.num_ramps, layout.num_antennas, layout.num_samples), complex)
    for share, velocity in zip(ranges, velocities, strict=True):
        delay = 2.0 * (share * reach_m + velocity * (starts_s + time_s)) / LIGHT
        phase = START_HZ * delay + SLOPE * (delay * time_s - delay**2 / 2.0)
        sine = rng.uniform(-0.6, 0.6)
        place = 0.5 * sine * (antenna + layout.num_antennas * transmitter)
        level = size * 10.0 ** rng.uniform(-1.0, 0.0)
        start = rng.uniform()
        samples += level * np.exp(2j * np.pi * (phase + place + start))
    if scene == "interfered":
        samples += _bursts(layout, rate, rng) * size
    samples *= phases * gains
    noise = rng.normal(size=(*samples.shape, 2)) @ np.array([1.0, 1.0j])
    samples += noise * (size / 20.0)
    return samples


def _bursts(layout: Layout, rate: float, rng: np.random.Generator) -> Any:
    """Chirps of another radar, 20 dB over the echoes, in every second ramp about."""
    time = np.arange(layout.num_samples)
    bursts = np.zeros((layout.num_ramps, 1, layout.num_samples), complex)
    other = -19e12 / rate**2
    for ramp in range(layout.num_ramps):
        crossing = (
            (rng.uniform() + 0.37 * ramp) * 2.0 * layout.num_samples % (2 * layout.num_samples)
        )
        offset = time - crossing
        inside = np.abs(other * offset) < 0.45
        bursts[ramp, 0] = 10.0 * inside * np.exp(1j * np.pi * other * offset**2)

    return bursts


def words_of(layout: Layout, samples: Any) -> Any:
    """Order samples as the layout does."""
    in_turn = layout.format.endswith("xwr16xx")
    if layout.samples == "real":
        real = np.sqrt(2.0) * samples.real
        ordered = real if in_turn else np.moveaxis(real, 1, 2)
    elif layout.format == "dca1000-xwr16xx":
        pairs = samples.reshape(*samples.shape[:-1], -1, 2)
        ordered = np.stack([pairs.real, pairs.imag], axis=-2)
    elif layout.format == "dca1000-xwr14xx":
        lanes = np.moveaxis(samples, 1, 2)
        ordered = np.stack([lanes.real, lanes.imag], axis=-2)
    else:
        parts = np.stack([samples.real, samples.imag], axis=-1)
        ordered = parts if in_turn else np.moveaxis(parts, 1, 2)
    whole = np.clip(np.rint(ordered), -(2**15), 2**15 - 1).astype(np.int32).reshape(-1)
    if layout.format.startswith("tsw"):
        return (whole + 2**15).astype("<u2")
    return whole.astype("<i2")


def main(picture: str) -> None:
    """Draw the three best guesses of three captures, and print how many are right."""
    import tempfile

    import matplotlib.pyplot as plt

    from vsep.recordings.guess import Guess, guess_layouts

    def guessed(*key: int) -> tuple[Guess, ...]:
        content = capture(LAYOUTS[key[1]], SCENES[key[2]], np.random.default_rng(key))
        with tempfile.NamedTemporaryFile(suffix=".bin") as file:
            file.write(content)
            file.flush()
            return guess_layouts(file.name)

    for seed in range(601, 605):
        right = {
            (number, scene): tuple(guessed(seed, number, scene)[0].settings.values())
            == LAYOUTS[number].settings
            for number in range(len(LAYOUTS))
            for scene in range(len(SCENES))
        }
        wrong = [f"{LAYOUTS[key[0]].format} {SCENES[key[1]]}" for key in right if not right[key]]
        sys.stdout.write(f"seed {seed}: {sum(right.values())} of {len(right)} right; {wrong}\n")
    shown = ((2, 0), (3, 1), (5, 0))
    figure, axes = plt.subplots(len(shown), 3, figsize=(9.6, 5.4), layout="constrained")
    for row, (number, scene) in zip(axes, shown, strict=True):
        row[0].set_ylabel(SCENES[scene], fontsize=8)
        for axis, guess in zip(row, guessed(601, number, scene), strict=True):
            axis.imshow(guess.picture, aspect="auto", origin="lower", cmap="viridis")
            said = guess.settings
            axis.set_title(
                f"{said['format']}, {said['samples']}\n{said['num_samples']} samples, "
                f"{said['num_antennas']} x {said['num_transmitters']} channels, echoes in "
                f"{guess.evidence.echo_share:.1%}",
                fontsize=7,
            )
            axis.set_xticks([])
            axis.set_yticks([])
    figure.savefig(Path(picture), dpi=100)


if __name__ == "__main__":
    main(sys.argv[1])
