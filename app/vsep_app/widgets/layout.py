"""Building blocks of the page: cards, panels, theme and style sheets."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any

import panel as pn
import panel_material_ui as pmu

from vsep_app.assets import path
from vsep_app.views.progress import ProgressView

# Of a button in the header that has no room for its name.
ICON_ONLY = {
    "fontSize": 0,
    "minWidth": 0,
    "& .MuiIcon-root, & svg": {"fontSize": "20px !important"},
    "@media (max-width: 599px)": {
        "paddingInline": "4px",
        "& .MuiButton-startIcon": {"margin": 0},
        "& .MuiButton-endIcon": {"display": "none"},
    },
}


def stylesheet(name: str) -> str:
    """Return a style sheet of ``assets/css``."""
    return path(f"css/{name}.css").read_text(encoding="utf-8")


@contextmanager
def at_once() -> Iterator[None]:
    """Send all changes as one, and look through the document once: Bokeh does so after each."""
    document = pn.state.curdoc
    with pn.io.hold(), nullcontext() if document is None else document.models.freeze():
        yield


def html_pane(sheet: str, text: str = "", **options: Any) -> Any:
    """Return a pane of HTML with a style sheet, by default as large as its place."""
    usual = {"sizing_mode": "stretch_both", "stylesheets": [stylesheet(sheet)]}
    return pn.pane.HTML(text, **{**usual, **options})


def status_html(text: str) -> str:
    """Return the state of a page in bold."""
    return f'<strong role="status" style="font-size:13px;white-space:nowrap">{text}</strong>'


def status_pane(text: str) -> Any:
    """Return the place of the state of a page in the header."""
    return pn.pane.HTML(status_html(text), margin=(0, 12), styles={"color": "white"})


def theme() -> dict[str, Any]:
    """Return the light and the dark theme; primary colours keep 4.5:1 against their page."""
    # The title of the page gives way to the links where there is no room for both; it stays the
    # name of the link around it.
    unseen = {"position": "absolute", "width": 1, "height": 1, "overflow": "hidden"}
    title = {"@media (max-width: 1599px)": {**unseen, "clipPath": "inset(50%)"}}
    typography = {"fontSize": 12.5, "button": {"textTransform": "none"}, "h3": title}
    bar = {"styleOverrides": {"root": {"backgroundColor": "#0B3A5B", "color": "#FFFFFF"}}}
    # Switches are wrapped by their label, so the area to click need not stick out of the thumb.
    switch = {"styleOverrides": {"input": {"left": 0, "width": "100%"}}}
    # An icon is its name written in a font that has it for this word.
    ligatures = {"fontFamily": "Material Icons", "fontFeatureSettings": "'liga'"}
    plain = {"lineHeight": 1, "letterSpacing": "normal", "whiteSpace": "nowrap"}
    icon = {"styleOverrides": {"root": {**ligatures, **plain, "textTransform": "none"}}}
    components = {"MuiAppBar": bar, "MuiIcon": icon, "MuiSwitch": switch}
    common = {"typography": typography, "components": components}
    return {
        "light": {"palette": {"primary": {"main": "#005F94"}}, **common},
        "dark": {"palette": {"primary": {"main": "#56B4E9"}}, **common},
    }


def card(
    plot: Any, *, weight: int, height: int | None = None, look: str = "card", key: str = ""
) -> Any:
    """Return a framed figure that takes its share of the free height, or a fixed one."""
    flex = f"{weight} 1 0" if height is None else f"0 0 {height}px"
    content: list[Any] = [pn.pane.Bokeh(plot, sizing_mode="stretch_both", margin=0)]
    if key:
        content.append(html_pane("key", key, margin=0, sizing_mode=None))
    return stack(*content, sheet=look, margin=3, flex=flex)


def stack(
    *content: Any,
    weight: float = 1,
    row: bool = False,
    sheet: str = "column",
    margin: int = 0,
    flex: str = "",
) -> Any:
    """Return a column, or a row, that takes its share of the free room and may shrink."""
    return (pn.Row if row else pn.Column)(
        *content,
        margin=margin,
        sizing_mode="stretch_both",
        styles={"flex": flex or f"{weight} 1 0", "min-height": "0", "min-width": "0"},
        stylesheets=[stylesheet(sheet)] if sheet else [],
    )


def main_part(title: str, *content: Any) -> Any:
    """Return the main part of a page below its unseen title."""
    return pn.Column(
        unseen_title(title),
        *content,
        margin=0,
        sizing_mode="stretch_width",
        stylesheets=[stylesheet("main")],
    )


def toolbar(*content: Any) -> Any:
    """Return the row of buttons, progress and choices above the figures."""
    return pn.Row(
        *content,
        sizing_mode="stretch_width",
        styles={"min-height": "52px"},
        margin=(2, 3, 0, 3),
        align="center",
        stylesheets=[stylesheet("transport")],
    )


def progress_bar() -> Any:
    """Return an empty bar for the toolbar."""
    return pmu.LinearProgress(
        value=0, variant="determinate", sizing_mode="stretch_width", min_width=80, margin=(22, 12)
    )


def download_button(label: str, filename: str, callback: Callable[[], Any], text: str) -> Any:
    """Return a button of the toolbar that makes a file when it is pressed."""
    button = pmu.FileDownload(
        label=label,
        callback=callback,
        filename=filename,
        description=text,
        size="small",
        margin=(9, 3),
    )
    # Given to the constructor it makes the widget warn of its own default.
    button.variant = "outlined"
    return button


def panel(title: str, content: Any, *, weight: float, tools: Sequence[Any] = ()) -> Any:
    """Return a framed panel with a heading and, beside it, small buttons."""
    heading: Any = html_pane(
        "tables",
        f'<h2 class="panel">{title}</h2>',
        margin=(4, 8, 2, 8),
        sizing_mode="stretch_width",
        # Where there is no room for all, the heading is cut off, not the buttons.
        styles={"min-width": "0"},
    )
    if tools:
        heading = pn.Row(heading, *tools, margin=0, sizing_mode="stretch_width")
    return stack(heading, content, weight=weight, sheet="card", margin=3)


def progress_card(view: ProgressView) -> Any:
    """Return the three small curves in one frame."""
    panes = [pn.pane.Bokeh(plot, sizing_mode="stretch_both", margin=0) for plot in view.figures]
    for pane, weight in zip(panes, (10, 10, 16), strict=True):
        pane.styles = {"flex": f"{weight} 1 0", "min-height": "0"}
    return stack(*panes, weight=11, sheet="card", margin=3)


def heading(text: str) -> Any:
    """Return a heading of the side bar."""
    return pn.pane.HTML(
        f'<h2 style="font-size:13px;font-weight:600;margin:0">{text}</h2>',
        margin=(8, 16, 2, 16),
        sizing_mode="stretch_width",
    )


def small_text(text: str) -> str:
    """Return a remark below a control as HTML."""
    return f'<p style="font-size:11px;margin:0;opacity:.75">{text}</p>'


def unseen_title(text: str) -> Any:
    """Return the heading of a page for those who hear it; the header shows it already."""
    return html_pane(
        "tables",
        f'<h1 class="unseen">{text}</h1>',
        css_classes=["unseen-title"],
        margin=0,
        height=0,
        sizing_mode="stretch_width",
    )


def number_or_nothing(text: str) -> float | None:
    """Return the number in a field, None if it is empty; anything else is a ValueError.

    Examples
    --------
    >>> number_or_nothing("9.5"), number_or_nothing(" ")
    (9.5, None)
    """
    return float(text) if text.strip() else None
