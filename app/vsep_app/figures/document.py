"""HTML documents of figures, self-contained and reproducible to the byte.

The drawing library numbers its models by a counter of the process and draws the rest of its names
at random. Here both are numbered in the order in which they appear, so that equal figures make
equal documents, whatever the process did before. For the same reason nothing but the library's
script and the description of the figures is taken from it: a web page in the same process changes
its templates.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.core.json_encoder import serialize_json
from bokeh.embed.util import OutputDocumentFor, standalone_docs_json_and_render_items
from bokeh.model import Model
from bokeh.resources import Resources
from jinja2 import Environment, FunctionLoader, StrictUndefined

from vsep_app.assets import path

_MODEL = re.compile(r'"id":"(p\d+)"')
_QUOTED = re.compile(r'"(p\d+)"')
_RANDOM = re.compile(r"[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[0-9a-f]{4}-[0-9a-f]{12}")


def document_html(
    plots: Sequence[Model], *, template: str, title: str, variables: Mapping[str, Any]
) -> str:
    """Return figures as one document that asks for nothing else.

    Parameters
    ----------
    plots : sequence of Model
        The figures; the template places them by their names.
    template : str
        A file of ``assets/report``.
    title : str
        Of the browser's window.
    variables : mapping
        For the template; ``base.html`` shows `provenance` where there is one.
    """
    with OutputDocumentFor(plots, always_new=True):
        documents, items = standalone_docs_json_and_render_items(
            plots, suppress_callback_warning=True
        )
    for document in documents.values():
        # Models that a web page in this process has defined; no figure is made of them.
        document.pop("defs", None)
    page = _environment().get_template(template)
    html = page.render(
        title=title,
        style=_asset("report.css"),
        library=Resources(mode="inline", components=["bokeh"], minified=True).js_raw,
        documents=serialize_json(documents).replace("<", "\\u003c"),
        items=serialize_json([item.to_json() for item in items]),
        roots=list(items[0].roots),
        **variables,
    )
    return numbered(html)


def page_html(template: str, **variables: Any) -> str:
    """Return a page without figures of the drawing library, with the style of reports."""
    return _environment().get_template(template).render(style=_asset("report.css"), **variables)


def numbered(html: str) -> str:
    """Return a document with models and random names numbered in the order in which they appear.

    Examples
    --------
    >>> numbered('{"id":"p1742"}, {"id":"p1013"}, ["p1742", "p9"]')
    '{"id":"p1000"}, {"id":"p1001"}, ["p1000", "p9"]'
    """
    models = {name: f"p{1000 + n}" for n, name in enumerate(dict.fromkeys(_MODEL.findall(html)))}
    html = _QUOTED.sub(lambda match: f'"{models.get(match.group(1), match.group(1))}"', html)
    names = {name: n for n, name in enumerate(dict.fromkeys(_RANDOM.findall(html)))}
    return _RANDOM.sub(lambda match: f"a0000000-0000-4000-8000-{names[match.group()]:012d}", html)


def _asset(name: str) -> str:
    return path(f"report/{name}").read_text(encoding="utf-8")


def _environment() -> Environment:
    return Environment(
        loader=FunctionLoader(_asset), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
