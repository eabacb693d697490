"""Frames as labelled arrays of xarray."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vsep._optional import require_library
from vsep._typing import BoolArray, ComplexArray
from vsep.signal.radar import ChirpSequence


def labelled(
    name: str,
    signal: ComplexArray,
    radar: ChirpSequence,
    missing: BoolArray | None,
    more: Mapping[str, Any],
) -> Any:
    """Return a signal (antennas, ramps, samples) as an `xarray.DataArray`.

    `missing` becomes a coordinate, `more` attributes beside the radar's values.
    """
    xarray = require_library("xarray", "A labelled array", "xarray")
    antennas, ramps, samples = signal.shape
    known = {
        "start_frequency_hz": radar.start_frequency_hz,
        "slope_hz_per_s": radar.slope_hz_per_s,
        "sample_rate_hz": radar.sample_rate_hz,
        "ramp_period_s": radar.ramp_period_s,
        "lowest_beat": radar.lowest_beat,
        **more,
    }
    coordinates: dict[str, Any] = {
        "antenna": np.arange(antennas),
        "ramp": np.arange(ramps),
        "sample": np.arange(samples),
        "ramp_start_s": ("ramp", np.arange(ramps) * radar.ramp_period_s),
        "sample_time_s": ("sample", np.arange(samples) / radar.sample_rate_hz),
    }
    if missing is not None:
        coordinates["missing"] = (("antenna", "ramp", "sample"), missing)
    return xarray.DataArray(
        signal,
        dims=("antenna", "ramp", "sample"),
        coords=coordinates,
        name=name,
        attrs={name: value for name, value in known.items() if value is not None},
    )
