"""Fields of side bar and toolbar, with the margins that they have in all of them."""

from typing import Any

import panel as pn
import panel_material_ui as pmu

_SLIDERS = (pmu.FloatSlider, pmu.IntSlider, pmu.DiscreteSlider)
MARGIN = (6, 16, 6, 16)
_SLIDER_MARGIN = (0, 22, 0, 18)
_SWITCH_MARGIN = (0, 12, 0, 18)
_HALVES = (6, 4, 6, 16), (6, 16, 6, 4)


def field(kind: Any, label: str, text: str, **options: Any) -> Any:
    """Return a widget of a class as wide as the side bar, with a label, a tooltip and options."""
    margin = _SLIDER_MARGIN if kind in _SLIDERS else MARGIN
    margin = _SWITCH_MARGIN if kind is pmu.Switch else margin
    usual = {"margin": margin, "sizing_mode": "stretch_width", "size": "small"}
    return kind(label=label, description=text, **{**usual, **options})


def number_field(label: str, text: str, value: float, start: float, end: float) -> Any:
    """Return a field for a number to type; a whole one if the value is."""
    kind = pmu.IntInput if isinstance(value, int) else pmu.FloatInput
    return field(kind, label, text, value=value, start=start, end=end)


def file_field(label: str, text: str, suffix: str) -> Any:
    """Return a field for a file of a suffix."""
    return field(pmu.FileInput, label, text, accept=suffix, variant="outlined")


def tool_field(kind: Any, label: str, text: str, **options: Any) -> Any:
    """Return a widget of a fixed width for the toolbar above the figures."""
    return field(kind, label, text, margin=(7, 4, 0, 4), sizing_mode=None, **options)


def tool_button(label: str, icon: str, text: str, **options: Any) -> Any:
    """Return a button for the toolbar above the figures."""
    usual = {"variant": "outlined", "size": "small", "margin": (9, 3)}
    return pmu.Button(label=label, icon=icon, description=text, **{**usual, **options})


def pair(left: Any, right: Any) -> Any:
    """Return two widgets that share a line."""
    left.margin, right.margin = _HALVES
    return pn.Row(left, right, margin=0, sizing_mode="stretch_width")
