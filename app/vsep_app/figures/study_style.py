"""Colours, markers and dashes of study figures, the same on screen and in print.

Every method has a colour and a marker of its own. Those that are drawn most have the colours of
Okabe and Ito, safe for colour-blind readers; the others are as far apart as they can be. A marker
tells methods apart without colour, a dash the variants of one method.
"""

from vsep.studies.methods import method_names

_LOOKS = {
    "factorised": ("#0072B2", "circle"),
    "joint": ("#009E73", "square"),
    "object-only": ("#D55E00", "triangle"),
    "masked": ("#E69F00", "inverted_triangle"),
    "masked-autoregressive": ("#8B5FBF", "star"),
    "zeroing": ("#0000FF", "hex"),
    "blanking": ("#AAAADD", "hex_dot"),
    "linear": ("#664466", "plus"),
    "autoregressive": ("#00CC00", "square_pin"),
    "slow-time": ("#335533", "triangle_pin"),
    "noise-canceller": ("#774400", "cross"),
    "mca": ("#FF0066", "circle_cross"),
    "mca-2d": ("#993333", "square_cross"),
    "mca-unmasked": ("#FF00EE", "diamond_cross"),
    "ist": ("#667700", "circle_x"),
    "iht": ("#33BBCC", "square_x"),
    "iht-plain": ("#99BB77", "asterisk"),
    "pm-ist": ("#88BB00", "circle_dot"),
    "pm-iht": ("#0077FF", "square_dot"),
    "fista": ("#CC9966", "circle_y"),
    "omp": ("#8855FF", "diamond_dot"),
    "cosamp": ("#BB00FF", "star_dot"),
    "amp": ("#008811", "triangle_dot"),
    "gamp": ("#880099", "x"),
    "yall1": ("#991155", "y"),
    "no-interference": ("#7F7F7F", "diamond"),
}
"""Colour and marker of a method; no two have either in common."""
_COLOURS = {
    "scene": "#CC79A7",
    "bound": "#000000",
    "guide": "#999999",
    "received": "#B0B0B0",
    "interference estimate": "#D55E00",
    "true objects": "#CC79A7",
    "object estimate": "#0072B2",
    "true object": "#CC79A7",
    "estimated object": "#0072B2",
    "detection": "#FF9F1C",
    "false estimate": "#FF0022",
    "channel component": "#D55E00",
    "mitigated": "#009E73",
}
# Of all others, those of other distributions among them.
_OTHER_COLOURS = ("#DD1199", "#EE77FF", "#FF6655", "#FF0022", "#444444", "#00AA88")
_OTHER_MARKERS = ("dash", "dot")
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
    "y": r"$\Upsilon$",
    "asterisk": r"$\ast$",
    "dash": "$-$",
    "dot": r"$\cdot$",
    "circle_cross": r"$\oplus$",
    "circle_x": r"$\otimes$",
    "circle_dot": r"$\odot$",
    "circle_y": r"$\ominus$",
    "square_cross": r"$\boxplus$",
    "square_x": r"$\boxtimes$",
    "square_dot": r"$\boxdot$",
    "diamond_cross": "d",
    "diamond_dot": r"$\diamond$",
    "hex_dot": "p",
    "star_dot": (6, 1, 0),
    "triangle_dot": r"$\triangle$",
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
    if role in _LOOKS:
        return _LOOKS[role][0]
    return _COLOURS.get(role) or _OTHER_COLOURS[_number(role) % len(_OTHER_COLOURS)]


def marker(role: str) -> str:
    """Bokeh's name of the marker of a role.

    Examples
    --------
    >>> marker("joint")
    'square'
    """
    if role in _LOOKS:
        return _LOOKS[role][1]
    return _OTHER_MARKERS[_number(role) % len(_OTHER_MARKERS)]


def is_filled(shape: str) -> bool:
    """Whether a marker is filled; what lies in a hollow one would not be seen in it otherwise.

    Examples
    --------
    >>> is_filled("circle"), is_filled("circle_x")
    (True, False)
    """
    return not shape.endswith(("_cross", "_x", "_dot", "_y"))


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
    others = [name for name in method_names() if name not in _LOOKS]
    return others.index(role) if role in others else sum(role.encode())
