"""What the axis of a figure is called for each parameter, and where a point lies on it."""

from collections.abc import Mapping
from typing import Any, Final

from vsep.presets.scenes import preset_radar

X_LABELS: Final = {
    "snr_db": "SNR [dB]",
    "sir_db": "SIR [dB]",
    "false_alarm_rate": "false-alarm rate asked for [1/frame]",
    "interferer_slope_hz_per_s": "slope difference [MHz/µs]; at 0.1 a burst fills a ramp",
    "num_interfered_ramps": "interfered ramps of 16",
}
_HZ_PER_S = 1e12  # in a MHz/us


def x_value(point: Mapping[str, Any], x: str) -> float:
    """Return where a point lies on an axis; an interferer's slope by its distance to the victim's.

    Parameters
    ----------
    point : mapping
        Parameters of the point by name.
    x : str
        One of `X_LABELS`.

    Examples
    --------
    >>> x_value({"sir_db": -20.0}, "sir_db")
    -20.0
    >>> x_value({"interferer_slope_hz_per_s": 9.5e12}, "interferer_slope_hz_per_s")
    0.5
    """
    value = point[x]
    if value is None:
        return float("nan")
    if x == "interferer_slope_hz_per_s":
        # The radars of both simulations have the same slope.
        return abs(float(value) - preset_radar("simulation-1").slope_hz_per_s) / _HZ_PER_S
    return float(value)
