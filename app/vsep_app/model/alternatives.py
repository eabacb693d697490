"""Figures in words, for those who do not see them."""

import numpy as np

from vsep._typing import FloatArray
from vsep_app.model.crossing import Courses
from vsep_app.model.picture import Picture
from vsep_app.model.text import counted

_MOST_NAMED = 12


def alternatives(picture: Picture) -> dict[str, str]:
    """Return one or two sentences for each figure, by its name."""
    static_picture, crossing = picture.static_picture, picture.crossing
    plane = crossing.plane
    known = static_picture.observation.truth is not None
    lines = {
        "Chirps": f"Band of {plane.band_mhz:.3g} MHz to either side of the own chirp. "
        + (f"Chirps of another radar cross it {_ramps(crossing.true)}. " if known else "")
        + f"Bursts are found {_ramps(crossing.found)}.",
        "Fast time": f"Ramp {picture.ramp}: received, {_extent(picture.fast_time.received)}"
        + (
            f"; cleaned, {_extent(picture.fast_time.cleaned)}."
            if np.isfinite(picture.fast_time.cleaned).any()
            else "; nothing is cleaned."
        ),
        "Delay spectrum": f"Ramp {picture.ramp}: received, {_extent(picture.delay.received)}. "
        f"{_places(picture.objects.ranges_m)}",
    }
    if static_picture.radar.num_ramps > 1:
        missed = () if picture.score is None else picture.score.missed
        true = picture.true_objects
        away = ", ".join(
            f"{true.ranges_m[at]:.1f} m and {true.velocities_mps[at]:+.1f} m/s" for at in missed
        )
        lines["Range-Doppler maps"] = (
            f"{'After' if picture.is_cleaned else 'Before'} the bursts are cancelled. "
            + ("" if picture.score is None else f"{picture.score.text}. ")
            + (f"Missed: {away}." if away else "")
        )
    return lines


def _ramps(courses: Courses) -> str:
    ramps = sorted({int(ramp) for ramp in courses.ramps})
    if not ramps:
        return "in no ramp"
    if len(ramps) > _MOST_NAMED:
        return f"in {len(ramps)} ramps"
    return f"in ramp{'s' * (len(ramps) > 1)} {', '.join(map(str, ramps))}"


def _extent(values: FloatArray) -> str:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "not known"
    return f"median {np.median(finite):.0f}, largest {finite.max():.0f}"


def _places(ranges_m: FloatArray) -> str:
    if len(ranges_m) > _MOST_NAMED or not len(ranges_m):
        return f"{counted(len(ranges_m), 'object')} estimated.".replace("0 objects", "No object")
    return "Objects at " + ", ".join(f"{each:.1f} m" for each in np.sort(ranges_m)) + "."
