"""Axes of the studies' figures: their labels, and the positions of points on them."""

from collections.abc import Mapping
from typing import Any, Final

from vsep.parameters import PARAMETERS
from vsep.presets.registry import SCENES

X_LABELS: Final = {
    "snr_db": PARAMETERS["snr_db"].label,
    "sir_db": PARAMETERS["sir_db"].label,
    "false_alarm_rate": "false-alarm rate asked for [1/frame]",
    "interferer_slope_hz_per_s": "slope difference [MHz/µs]; at 0.1 a burst fills a ramp",
    "num_interfered_ramps": "interfered ramps of 16",
    "rolled_ramps": "ramps by which bursts are moved",
    "share_lost": "share of a ramp that is lost",
    "num_prior_frames": "earlier frames, Q",
    "control": "threshold control, β",
    "step_width": "step width, θ",
    "samples_per_ramp": "samples drawn from a ramp, p",
    "num_ramps": "ramps, of as many samples",
}
_HZ_PER_S = 1e12  # in a MHz/us


def x_label(x: str) -> str:
    """Return what the axis of a parameter is called.

    Examples
    --------
    >>> x_label("sir_db"), x_label("filter_mismatch")
    ('SIR [dB]', 'filter mismatch')
    """
    return X_LABELS.get(x, x.replace("_", " "))


def x_value(point: Mapping[str, Any], x: str) -> float:
    """Return where a point lies on an axis; an interferer's slope by its distance to the victim's.

    Parameters
    ----------
    point : mapping
        Parameters of the point by name.
    x : str
        Name of one of them.

    Examples
    --------
    >>> x_value({"sir_db": -20.0}, "sir_db")
    -20.0
    >>> point = {"scene": "simulation-1", "interferer_slope_hz_per_s": 9.5e12}
    >>> x_value(point, "interferer_slope_hz_per_s")
    0.5
    """
    value = point[x]
    if value is None:
        return float("nan")
    if x == "interferer_slope_hz_per_s":
        victim, *_ = SCENES[point["scene"]]
        return abs(float(value) - victim.radar.slope_hz_per_s) / _HZ_PER_S
    return float(value)
