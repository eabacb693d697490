"""Curves of a study on the page: one figure of the paper at a time, its panels side by side.

A panel is drawn once and then only gets newer numbers, so that nothing flickers and the zoom of
its user stays; it is drawn anew where it has other curves than before.
"""

from collections.abc import Sequence
from html import escape
from typing import Any

from vsep.studies.panels import AnyPanel, BoxPanel, Series
from vsep_app.figures.study_elements import panel_shape
from vsep_app.figures.study_figure import draw_panel, update_panel
from vsep_app.figures.study_style import DASHES, colour, marker, width
from vsep_app.widgets.layout import card, html_pane, stack

# Black has no contrast with the dark page.
_SCREEN_COLOURS = {"#000000": "#8C8C8C"}
_DASH_ARRAYS = dict(zip(DASHES, ("", "6 4", "2 3", "6 3 2 3"), strict=True))
_SHAPES = {
    "circle": '<circle cx="11" cy="5" r="3"/>',
    "square": '<path d="M8 2H14V8H8Z"/>',
    "triangle": '<path d="M11 1.5L14.5 8H7.5Z"/>',
    "diamond": '<path d="M11 1L14 5L11 9L8 5Z"/>',
    "inverted_triangle": '<path d="M11 8.5L14.5 2H7.5Z"/>',
    "star": '<path d="M11 1L12.2 4H15L12.8 6L13.6 9L11 7.2L8.4 9L9.2 6L7 4H9.8Z"/>',
    "hex": '<path d="M8 3.3L11 1.5L14 3.3V6.7L11 8.5L8 6.7Z"/>',
    "plus": '<path d="M10 2H12V4H14V6H12V8H10V6H8V4H10Z"/>',
    "square_pin": '<path d="M8 2Q11 4 14 2Q12 5 14 8Q11 6 8 8Q10 5 8 2Z"/>',
    "triangle_pin": '<path d="M11 1Q11.5 5 14.5 8Q11 6.5 7.5 8Q10.5 5 11 1Z"/>',
    "cross": '<path d="M8 5H14M11 2V8"/>',
    "x": '<path d="M8 2L14 8M8 8L14 2"/>',
    "y": '<path d="M11 5V9M11 5L8 2M11 5L14 2"/>',
    "asterisk": '<path d="M8 5H14M11 2V8M9 3L13 7M9 7L13 3"/>',
    "dash": '<path d="M8 5H14" stroke-width="3"/>',
    "dot": '<circle cx="11" cy="5" r="1"/>',
}
# Hollow, with something inside.
_SHAPES |= {
    f"{outer}_{inner}": f'<g fill="none">{_SHAPES[outer]}<path d="{line}"/></g>'
    for outer, inners in (
        ("circle", "cross x dot y"),
        ("square", "cross x dot"),
        ("diamond", "cross dot"),
        ("hex", "dot"),
        ("star", "dot"),
        ("triangle", "dot"),
    )
    for inner in inners.split()
    for line in (
        {
            "cross": "M8 5H14M11 2V8",
            "x": "M9 3L13 7M9 7L13 3",
            "dot": "M10.5 5.5H11.5",
            "y": "M11 5V8M11 5L9 3M11 5L13 3",
        }[inner],
    )
}
_MARKS = {"crosses": '<path d="M8 2L14 8M8 8L14 2"/>', "stems": '<circle cx="11" cy="5" r="3.5"/>'}


class StudyCurves:
    """The panels of one title, in up to two columns."""

    def __init__(self) -> None:
        self.key = html_pane("study", margin=(2, 8), sizing_mode="stretch_width")
        self.grid = stack(_hint())
        self._shapes: list[tuple[Any, ...]] = []
        self._places: list[Any] = []

    def show(self, panels: Sequence[AnyPanel]) -> None:
        """Show panels of one title in place of those before."""
        shapes = [panel_shape(panel) for panel in panels]
        if [shape[:2] for shape in shapes] != [shape[:2] for shape in self._shapes]:
            self._places = [_place(panel) for panel in panels]
            self.grid.objects = _rows(self._places) or [_hint()]
        else:
            for index, panel in enumerate(panels):
                note, pane = self._places[index].objects
                note.object = _note_html(panel)
                if shapes[index] == self._shapes[index]:
                    update_panel(pane.object, panel)
                else:
                    pane.object = _screen_figure(panel)
        self._shapes = shapes
        key = _key_html(panels)
        if key != self.key.object:
            self.key.object = key


def _hint() -> Any:
    return html_pane(
        "study",
        '<p class="empty">Choose a study and press Run. Curves and their intervals grow as trials '
        "finish; a click on a single trial opens it in the live view.</p>",
        sizing_mode="stretch_width",
    )


def _place(panel: AnyPanel) -> Any:
    """Return a framed panel below its note."""
    place = card(_screen_figure(panel), weight=1)
    look = {"margin": (2, 8, 0, 8), "height": 14, "sizing_mode": "stretch_width"}
    note = html_pane("study", _note_html(panel), **look)
    place.insert(0, note)
    return place


def _note_html(panel: AnyPanel) -> str:
    return f'<p class="note" title="{escape(panel.note)}">{escape(panel.note)}</p>'


def _rows(places: Sequence[Any]) -> list[Any]:
    """Two columns, or one below the other where there are only two."""
    columns = 1 if len(places) <= 2 else 2
    return [
        stack(*places[start : start + columns], row=True)
        for start in range(0, len(places), columns)
    ]


def _screen_figure(panel: AnyPanel) -> Any:
    """Draw a panel to fit its place, its key apart."""
    plot = draw_panel(panel)
    plot.update(width=None, height=None, min_height=60, sizing_mode="stretch_both")
    plot.name = f"study-{panel.y_label}"
    for apart in (*plot.legend, plot.title):
        apart.visible = False
    for renderer in plot.renderers:
        glyph = renderer.glyph
        for name in ("line_color", "fill_color", "text_color"):
            shade = getattr(glyph, name, None)
            if isinstance(shade, str) and shade in _SCREEN_COLOURS:
                setattr(glyph, name, _SCREEN_COLOURS[shade])
    return plot


def _key_html(panels: Sequence[AnyPanel]) -> str:
    """Return one key for all panels; boxes have the names of their methods below them."""
    entries: dict[str, Series] = {}
    for panel in panels:
        if not isinstance(panel, BoxPanel):
            for series in panel.series:
                entries.setdefault(series.label, series)
    items = "".join(
        f'<span class="item">{sample(series)}{escape(label)}</span>'
        for label, series in entries.items()
    )
    title = f"<h2>{escape(panels[0].title)}</h2>" if panels else ""
    return f'{title}<div class="key">{items}</div>'


def sample(series: Series) -> str:
    """Return what stands for a series in the key."""
    shade = colour(series.role)
    shade = _SCREEN_COLOURS.get(shade, shade)
    dash = _DASH_ARRAYS[DASHES[series.variant % len(DASHES)]]
    line = f'<path d="M0 5H22" stroke-width="{width(series.role)}" stroke-dasharray="{dash}"/>'
    if series.kind == "curve":
        line += f'<g fill="{shade}">{_SHAPES[marker(series.role)]}</g>'
    elif series.kind == "dashed":
        line = f'<path d="M0 5H22" stroke-width="1.5" stroke-dasharray="{_DASH_ARRAYS["dashed"]}"/>'
    elif series.kind in _MARKS:
        line = _MARKS[series.kind]
    return (
        f'<svg width="22" height="10" aria-hidden="true" fill="none" stroke="{shade}">{line}</svg>'
    )
