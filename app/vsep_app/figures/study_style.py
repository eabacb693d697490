"""Colours, markers and dashes of study figures, the same on screen and in print.

Colours are those of Okabe and Ito, safe for colour-blind readers; a marker tells methods apart
without colour, a dash the variants of one method.
"""

from vsep.mitigation.registry import MITIGATIONS

_COLOURS = {
    "factorised": "#0072B2",
    "joint": "#009E73",
    "object-only": "#D55E00",
    "masked": "#E69F00",
    "masked-autoregressive": "#8B5FBF",
    "no-interference": "#7F7F7F",
    "scene": "#CC79A7",
    "bound": "#000000",
    "guide": "#999999",
    "received": "#B0B0B0",
    "interference estimate": "#D55E00",
    "true objects": "#CC79A7",
    "object estimate": "#0072B2",
    "true object": "#CC79A7",
    "estimated object": "#0072B2",
    "channel component": "#D55E00",
}
_OTHER_COLOURS = ("#E69F00", "#56B4E9", "#8B5FBF", "#A6761D", "#009E73", "#D55E00")
_MARKERS = {
    "factorised": "circle",
    "joint": "square",
    "object-only": "triangle",
    "masked": "inverted_triangle",
    "masked-autoregressive": "star",
    "no-interference": "diamond",
}
_OTHER_MARKERS = ("inverted_triangle", "star", "hex", "plus")
_MITIGATIONS = {name: number for number, name in enumerate(MITIGATIONS)}
DASHES = ("solid", "dashed", "dotted", "dotdash")


def colour(role: str) -> str:
    """Colour of a role; one that has none gets one by its name, always the same.

    Examples
    --------
    >>> colour("factorised")
    '#0072B2'
    """
    return _COLOURS.get(role) or _OTHER_COLOURS[_number(role) % len(_OTHER_COLOURS)]


def marker(role: str) -> str:
    """Bokeh's name of the marker of a role.

    Examples
    --------
    >>> marker("joint")
    'square'
    """
    return (
        _MARKERS.get(role)
        or _OTHER_MARKERS[_number(role) // len(_OTHER_COLOURS) % len(_OTHER_MARKERS)]
    )


def width(role: str) -> float:
    """Width of a role's line; the reference is wide, so that what lies on it leaves it in sight.

    Examples
    --------
    >>> width("no-interference") > width("factorised")
    True
    """
    return 3.5 if role == "no-interference" else 1.5


def _number(role: str) -> int:
    """Return the number of a role without a look of its own; mitigation methods have their own."""
    return _MITIGATIONS.get(role, sum(role.encode()))
