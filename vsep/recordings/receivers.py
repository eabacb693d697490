"""Receivers of a recording: which are kept, and constant offsets of their converters."""

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vsep.errors import InputError
from vsep.recordings.captured import Captured
from vsep.recordings.settings import REAL, RecordingSettings
from vsep.units import to_db

WEAK_DB: Final = 40.0  # below the others: a receiver that is hardly connected
TELLING_OFFSET_DB: Final = 0.0  # of real samples, to the rest: from here on an offset is remarked


def kept_receivers(path: str, captured: Captured, settings: RecordingSettings) -> Captured:
    """Leave out receivers that were not chosen, and those that are dead.

    Raises `InputError` if one that is chosen is not there.
    """
    count = captured.samples.shape[1]
    chosen = settings.chosen_antennas()
    if chosen is not None and max(chosen) >= count:
        raise InputError(
            f"antennas is {settings.antennas}, but {path} holds {count} receivers, 0 to "
            f"{count - 1}."
        )
    wanted = tuple(range(count)) if chosen is None else chosen
    levels = {antenna: _level(captured, antenna) for antenna in wanted}
    alive = tuple(antenna for antenna in wanted if levels[antenna] > 0.0)
    if not alive or len(wanted) == 1:
        return _taken(captured, wanted, ())
    remarks = []
    if len(alive) < len(wanted):
        dead = ", ".join(str(antenna) for antenna in wanted if antenna not in alive)
        remarks.append(
            f"Receivers {dead} of 0 to {count - 1} are constant, switched off or not connected; "
            f"they are left out, as antennas: {','.join(map(str, alive))} would."
        )
    if chosen is not None:
        return _taken(captured, alive, tuple(remarks))
    usual = float(np.median([levels[antenna] for antenna in alive]))
    weak = [each for each in alive if levels[each] < usual * 10.0 ** (-WEAK_DB / 10.0)]
    if weak:
        others = ",".join(str(antenna) for antenna in alive if antenna not in weak)
        remarks.append(
            f"Receiver {weak[0]} is {to_db(usual / levels[weak[0]]):.0f} dB weaker than the "
            f"others; antennas: {others} leaves it out."
        )
    return _taken(captured, alive, tuple(remarks))


def spacing_of(kept: tuple[int, ...] | None, spacing: float | None) -> float | None:
    """Return the spacing of the receivers that are kept; None where they are no uniform line."""
    if spacing is None or kept is None or len(kept) < 2:
        return spacing
    steps = set(np.diff(kept).tolist())
    step = steps.pop()
    return None if steps or step < 1 else spacing * step


def without_offset(captured: Captured, settings: RecordingSettings) -> Captured:
    """Take the mean of every receiver off, where that is wanted or the words know no sign."""
    wanted = settings.offset == "remove" or (
        settings.offset == "automatic" and captured.is_unsigned
    )
    is_real = settings.samples == REAL
    if not wanted and not (is_real and settings.offset == "automatic"):
        return captured
    samples = captured.samples
    present = np.ones(samples.shape) if captured.missing is None else ~captured.missing
    # A plain mean holds what echoes leak into it, which would then be an echo of its own.
    weights = present * np.blackman(samples.shape[-1] + 2)[1:-1]
    mean = np.sum(samples * weights, axis=(0, 2)) / np.maximum(weights.sum(axis=(0, 2)), 1e-9)
    rest = (samples - mean[:, None]) * present
    power = float(np.mean(np.abs(mean) ** 2))
    left = float(np.sum(np.abs(rest) ** 2) / present.sum())
    if power == 0.0 or left == 0.0:
        return captured
    level_db = float(to_db(power / left))
    size = _size(float(np.sqrt(power)), captured.unit)
    if not wanted:
        if level_db < TELLING_OFFSET_DB:
            return captured
        return _remarked(
            captured,
            f"The samples have a constant offset of {size}, {level_db:.0f} dB over the rest; "
            "offset: remove takes it off.",
        )
    remark = (
        f"A constant offset of {size} ({level_db:.0f} dB relative to the rest) was removed"
        + (", since no value is negative" if settings.offset == "automatic" else "")
        + "; offset: keep leaves it."
    )
    gaps = samples - mean[:, None]
    if captured.missing is not None:
        gaps = np.where(captured.missing, 0.0, gaps)
    return _remarked(replace(captured, samples=gaps), remark)


def _size(value: float, unit: float) -> str:
    return f"{value / unit:.4g} LSB" if unit else f"{value:.4g}"


def _level(captured: Captured, antenna: int) -> float:
    """Variance of what a receiver's converter gave; zero where it is constant."""
    values: NDArray[Any] = captured.samples[:, antenna]
    if captured.missing is not None:
        values = values[~captured.missing[:, antenna]]
    if values.size < 2 or np.all(values == values.reshape(-1)[0]):
        return 0.0
    return float(np.var(values))


def _taken(captured: Captured, antennas: tuple[int, ...], remarks: tuple[str, ...]) -> Captured:
    missing = captured.missing
    if missing is not None:
        missing = missing[:, antennas]
        missing = missing if missing.any() else None
    return replace(
        captured,
        kept=antennas if antennas != tuple(range(captured.samples.shape[1])) else None,
        samples=captured.samples[:, antennas],
        missing=missing,
        remarks=(*captured.remarks, *remarks),
    )


def _remarked(captured: Captured, remark: str) -> Captured:
    return replace(captured, remarks=(*captured.remarks, remark))
