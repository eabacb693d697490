"""Separability maps in a file: HTML that opens from disk, or PNG, SVG and PDF for print."""

from html import escape
from pathlib import Path

from vsep.errors import InputError
from vsep.files.writing import write_text
from vsep.separability.axes import AXES
from vsep.separability.map import LAYERS, SeparabilityMap
from vsep.separability.map_spec import MapSpec
from vsep_app.figures.document import document_html
from vsep_app.figures.map_elements import CONTOURS, EXPLANATIONS, map_overlay
from vsep_app.figures.map_view import MapView
from vsep_app.figures.static_figure import Place, write_static
from vsep_app.views.style import Axis

SUFFIXES = (".html", ".png", ".svg", ".pdf")
WIDTH, HEIGHT = 460, 360
_PANEL_INCHES = (4.3, 3.3)
_COLUMNS = 4


def write_map(separability_map: SeparabilityMap, out: Path) -> None:
    """Draw all layers of a map into a file, ``.html``, ``.png``, ``.svg`` or ``.pdf``.

    Raises `InputError` if the suffix is another one, `OSError` if the file cannot be written.
    """
    suffix = out.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"The map {out.name!r} must end in .html, .png, .svg or .pdf.")
    if suffix == ".html":
        write_text(out, map_html(separability_map))
        return
    places = [
        Place(map_overlay(separability_map, name, "matplotlib"), title=LAYERS[name].label)
        for name in shown_layers(separability_map)
    ]
    columns = _COLUMNS if len(places) > _COLUMNS else _COLUMNS // 2
    rows = [("", places[start : start + columns]) for start in range(0, len(places), columns)]
    rows[0] = describe(separability_map.spec), rows[0][1]
    write_static(rows, out, panel_inches=_PANEL_INCHES)


def map_html(separability_map: SeparabilityMap) -> str:
    """Return the layers as one HTML document that asks for nothing else; they zoom together."""
    x_axis, y_axis = Axis(), Axis()
    plots = []
    names = shown_layers(separability_map)
    for name in names:
        plot = MapView(x_axis, y_axis).update(separability_map, name)
        plot.update(sizing_mode="fixed", width=WIDTH, height=HEIGHT, name=name)
        plots.append(plot)
    texts = "".join(
        f"<dt>{escape(LAYERS[name].label)}</dt><dd>{EXPLANATIONS[name]}</dd>" for name in names
    )
    return document_html(
        plots,
        template="panels.html",
        title="vsep: separability",
        variables={
            "heading": describe(separability_map.spec),
            "sections": [("", names)],
            "remarks": f"<p>{CONTOURS}</p><dl>{texts}</dl>",
        },
    )


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
