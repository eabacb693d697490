"""HoloViews and its two back ends, loaded when the first figure that needs them is made.

A figure is described once, as HoloViews elements. Bokeh draws them on a page and in an HTML file,
Matplotlib in a PNG, SVG or PDF file.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any, Literal, TypeAlias

from bokeh.document import Document
from bokeh.models import DataRange1d

Backend: TypeAlias = Literal["bokeh", "matplotlib"]

_MODULES: dict[Backend, str] = {
    "bokeh": "holoviews.plotting.bokeh",
    "matplotlib": "holoviews.plotting.mpl",
}


@cache
def holoviews(backend: Backend) -> Any:
    """Return the library with a back end loaded, which takes a second or two the first time."""
    import holoviews as library

    import_module(_MODULES[backend])
    if library.Store.current_backend not in library.Store.registry:
        library.Store.set_current_backend(backend)
    return library


def bokeh_figure(element: Any, *, x_range: Any = None, y_range: Any = None) -> Any:
    """Return an element as a Bokeh figure that belongs to no document yet.

    Without a range of its own it follows the data until a user zooms, and then keeps that zoom.
    """
    drawn = holoviews("bokeh").renderer("bokeh").get_plot(element)
    # The renderer takes the document of the whole program, which holds what is drawn for good.
    drawn.document = Document()
    plot = drawn.state
    plot.update(x_range=x_range or DataRange1d(), y_range=y_range or DataRange1d())
    plot.output_backend = "canvas"
    return plot


def draw_on_axes(axes: Any, element: Any) -> None:
    """Draw an element into the axes of a Matplotlib figure."""
    renderer = holoviews("matplotlib").renderer("matplotlib")
    renderer.get_plot(element, fig=axes.figure, axis=axes, subplot=True)


def update_sources(plot: Any, columns: Sequence[Mapping[str, Any]]) -> None:
    """Give the glyphs of a figure new columns, in the order in which they were drawn."""
    for renderer, own in zip(plot.renderers, columns, strict=True):
        renderer.data_source.data = dict(own)
