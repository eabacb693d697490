"""Colours, markers and dashes of study figures, the same on screen and in print.

Colours are those of Okabe and Ito, safe for colour-blind readers; a marker tells methods apart
without colour, a dash the variants of one method.
"""

from vsep.studies.methods import method_names

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
# None of these is in the table above, so that no other method looks like one of its methods.
_OTHER_MARKERS = ("hex", "plus", "square_pin", "triangle_pin")
MARKERS: dict[str, str | tuple[int, int, int]] = {
    "circle": "o",
    "square": "s",
    "triangle": "^",
    "diamond": "D",
    "inverted_triangle": "v",
    "star": "*",
    "hex": "h",
    "plus": "P",
    "square_pin": (4, 1, 0),
    "triangle_pin": (3, 1, 0),
    "cross": "$+$",
    "x": r"$\times$",
}
"""Matplotlib's markers by the names that Bokeh has for them; all of them have an area."""
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
    turn = _number(role) // len(_OTHER_COLOURS)
    return _MARKERS.get(role) or _OTHER_MARKERS[turn % len(_OTHER_MARKERS)]


def width(role: str) -> float:
    """Width of a role's line; the reference is wide, so that what lies on it leaves it in sight.

    Examples
    --------
    >>> width("no-interference") > width("factorised")
    True
    """
    return 3.5 if role == "no-interference" else 1.5


def _number(role: str) -> int:
    """Return the place of a method among those without a look of their own."""
    others = [name for name in method_names() if name not in _MARKERS]
    return others.index(role) if role in others else sum(role.encode())
