"""The map of a question as a file: HTML that opens from disk, or PNG for print."""

from html import escape
from pathlib import Path

from bokeh.embed import file_html
from bokeh.layouts import column, gridplot
from bokeh.models import Div
from bokeh.resources import INLINE

from vsep.errors import InputError
from vsep.separability.axes import AXES
from vsep.separability.map import LAYERS, SeparabilityMap
from vsep.separability.map_spec import MapSpec
from vsep_app.figures.map_explanations import CONTOURS, EXPLANATIONS
from vsep_app.figures.map_print import write_print
from vsep_app.figures.map_view import MapView
from vsep_app.views.style import Axis

SUFFIXES = (".html", ".png")
WIDTH, HEIGHT = 460, 360
_COLUMNS = 2


def write_map(separability_map: SeparabilityMap, out: Path) -> None:
    """Draw all layers of a map into a file.

    Parameters
    ----------
    separability_map : SeparabilityMap
        What to draw.
    out : Path
        File to write, ``.html`` or ``.png``.

    Raises
    ------
    InputError
        If the suffix is another one.
    OSError
        If the file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"The map {out.name!r} must end in .html or .png.")
    if suffix == ".html":
        out.write_text(map_html(separability_map), encoding="utf-8")
    else:
        write_print(separability_map, out, title=describe(separability_map.spec))


def map_html(separability_map: SeparabilityMap) -> str:
    """Return the layers as one HTML document that asks for nothing else; they zoom together."""
    x_axis, y_axis = Axis(), Axis()
    plots, texts = [], []
    for name in shown_layers(separability_map):
        view = MapView(x_axis, y_axis, opens=False)
        view.update(separability_map, name)
        view.figure.update(sizing_mode="fixed", width=WIDTH, height=HEIGHT)
        plots.append(view.figure)
        texts.append(f"<dt><b>{escape(LAYERS[name].label)}</b></dt><dd>{EXPLANATIONS[name]}</dd>")
    heading = f"<h1 style='font-size:18px'>{escape(describe(separability_map.spec))}</h1>"
    document: str = file_html(
        column(
            Div(text=heading),
            gridplot(plots, ncols=_COLUMNS, toolbar_location="right"),
            Div(text=f"<p>{CONTOURS}</p><dl>{''.join(texts)}</dl>", width=_COLUMNS * WIDTH),
        ),
        resources=INLINE,
        title="vsep: separability",
    )
    return document


def shown_layers(separability_map: SeparabilityMap) -> list[str]:
    """Return the layers that hold anything: those of trials only if there were trials."""
    tried = bool(separability_map.finished.any())
    return [name for name, layer in LAYERS.items() if tried or not layer.empirical]


def describe(spec: MapSpec) -> str:
    """Say in one line what a map is of."""
    fixed = [f"{AXES[name].label} {value / AXES[name].scale:g}" for name, value in spec.fixed]
    parts = [spec.scene, *fixed, f"seed {spec.settings.seed}"]
    if spec.trials:
        parts.append(f"{spec.method}, {spec.trials} trials a cell")
    return f"Separability: {', '.join(parts)}"
