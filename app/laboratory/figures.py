"""The map of a question as a file: HTML that opens from disk, or PNG for print."""

from html import escape
from pathlib import Path

from bokeh.embed import file_html
from bokeh.layouts import column, gridplot
from bokeh.models import Div
from bokeh.resources import INLINE

from app.laboratory.explained import CONTOURS, EXPLANATIONS
from app.laboratory.print import write_print
from app.laboratory.view import MapView
from app.views.style import Axis
from vsep._arrays import InputError
from vsep.laboratory.atlas import LAYERS, Atlas
from vsep.laboratory.axes import AXES
from vsep.laboratory.question import Question

SUFFIXES = (".html", ".png")
WIDTH, HEIGHT = 460, 360
_COLUMNS = 2


def write_map(atlas: Atlas, out: Path) -> None:
    """Draw all layers of a map into a file.

    Parameters
    ----------
    atlas : Atlas
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
        out.write_text(map_html(atlas), encoding="utf-8")
    else:
        write_print(atlas, out, title=describe(atlas.question))


def map_html(atlas: Atlas) -> str:
    """Return the layers as one HTML document that asks for nothing else; they zoom together."""
    x_axis, y_axis = Axis(), Axis()
    plots, texts = [], []
    for name in shown_layers(atlas):
        view = MapView(x_axis, y_axis, opens=False)
        view.update(atlas, name)
        view.figure.update(sizing_mode="fixed", width=WIDTH, height=HEIGHT)
        plots.append(view.figure)
        texts.append(f"<dt><b>{escape(LAYERS[name].label)}</b></dt><dd>{EXPLANATIONS[name]}</dd>")
    heading = f"<h1 style='font-size:18px'>{escape(describe(atlas.question))}</h1>"
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


def shown_layers(atlas: Atlas) -> list[str]:
    """Return the layers that hold anything: those of trials only if there were trials."""
    tried = bool(atlas.finished.any())
    return [name for name, layer in LAYERS.items() if tried or not layer.empirical]


def describe(question: Question) -> str:
    """Say in one line what a map is of."""
    fixed = [f"{AXES[name].label} {value / AXES[name].scale:g}" for name, value in question.fixed]
    parts = [question.scene, *fixed, f"seed {question.settings.seed}"]
    if question.trials:
        parts.append(f"{question.method}, {question.trials} trials a cell")
    return f"Separability: {', '.join(parts)}"
