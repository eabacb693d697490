"""The documentation site: Markdown pages, executed examples, and a reference from docstrings.

``make docs`` writes it to ``build/docs``. The reference is made of the packages themselves: what is
public there is documented here, with no list to keep in step.
"""

import re
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from myst_parser.parsers.sphinx_ import MystParser
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.nodes import nested_parse_with_titles

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "app")]

import vsep  # noqa: E402  # the checkout's own
from vsep._version import __version__  # noqa: E402

project = "vsep"
author = "vsep contributors"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
exclude_patterns = ["conf.py"]
html_theme = "furo"
html_title = f"vsep {__version__}"
html_static_path: list[str] = []
html_copy_source = False
html_show_sourcelink = False
# The theme's icons come from its own files; nothing is fetched from outside.
myst_heading_anchors = 4
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
# A name in backticks is a link where there is one of that name, and else a name.
default_role = "py:obj"
suppress_warnings = ["ref.python"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True}

_FETCHED = re.compile(r"<(?:script|img|iframe|source)[^>]*\ssrc=\"(?:https?:)?//[^\"]*\"")
_STYLES = re.compile(r"<link(?![^>]*rel=\"canonical\")[^>]*href=\"(?:https?:)?//[^\"]*\"|@import")
_IN_STYLES = re.compile(r"url\(\s*[\"']?(?:https?:)?//[^)]*\)|@import[^;]*//")


def public_modules(package: str) -> list[str]:
    """Names of the public modules of a package and of its packages; of ``vsep`` its own alone."""
    names = []
    for module in iter_modules(import_module(package).__path__, f"{package}."):
        if module.name.rpartition(".")[2].startswith("_"):
            continue
        if not module.ispkg:
            names.append(module.name)
        elif package != "vsep":
            names += public_modules(module.name)
    return sorted(names)


class PublicNames(SphinxDirective):
    """A table of the names that ``import vsep`` gives, with links to their descriptions."""

    def run(self) -> list[nodes.Node]:
        """Make one row a name: the name, and the first line of its docstring."""
        lines = [".. list-table::", "   :widths: 30 70", ""]
        for name in vsep.__all__:
            value = getattr(vsep, name)
            if name.startswith("__"):
                continue
            home = f"{value.__module__}.{value.__qualname__}"
            lines += [
                f"   * - :py:obj:`{name} <{home}>`",
                f"     - {escaped((value.__doc__ or '').strip().splitlines()[0])}",
            ]
        return parsed(self, lines)


class Modules(SphinxDirective):
    """Every public module below a package, with its public functions and classes."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make a section of each module."""
        lines: list[str] = []
        for name in public_modules(self.arguments[0]):
            lines += [name, "-" * len(name), "", f".. automodule:: {name}", ""]
        return parsed(self, lines)


class ExampleParser(MystParser):
    """An example is a Python file: its docstring is Markdown text, the rest is shown as code."""

    supported = ("example",)

    def parse(self, inputstring: str, document: nodes.document) -> None:
        """Show title, text and code of a Python file."""
        text, code = split_example(inputstring)
        super().parse(f"# {text}\n\n```python\n{code}```\n", document)


def split_example(source: str) -> tuple[str, str]:
    """Split the source of an example into the text of its docstring and its code."""
    match = re.fullmatch(r'"""(.*?)"""\n+(.*)', source, flags=re.DOTALL)
    if match is None:
        raise ValueError("An example must begin with a docstring.")
    title, _, rest = match.group(1).strip().partition("\n")
    return f"{title.rstrip('.')}\n{rest}", match.group(2)


def parsed(directive: SphinxDirective, lines: list[str]) -> list[nodes.Node]:
    """Parse reStructuredText where a directive stands."""
    container = nodes.Element()
    nested_parse_with_titles(directive.state, StringList(lines, source="conf.py"), container)
    return list(container.children)


def escaped(line: str) -> str:
    """Escape what reStructuredText would take for markup and the docstrings mean literally."""
    parts = re.split(r"(``.*?``|`[^`]*`)", line)
    return "".join(
        part if part.startswith("`") else re.sub(r"([|*]|(?<=\w)_(?=\W|$))", r"\\\1", part)
        for part in parts
    )


def escape_docstring(
    app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]
) -> None:
    """Escape norms such as ``|r|`` in the text of docstrings; indented blocks stay."""
    del app, what, name, value, options
    lines[:] = [
        line if line.lstrip().startswith((">>>", "...")) or "|" not in line else escaped(line)
        for line in lines
    ]


def require_no_network(app: Sphinx, error: Exception | None) -> None:
    """Refuse a site that would load a script, style, font or picture from elsewhere."""
    if error is not None or app.builder.format != "html":
        return
    for path in Path(app.outdir).rglob("*"):
        patterns = {".html": (_FETCHED, _STYLES), ".css": (_IN_STYLES,)}.get(path.suffix, ())
        text = path.read_text(encoding="utf-8") if patterns else ""
        for match in (match for pattern in patterns for match in pattern.finditer(text)):
            raise ValueError(f"{path.name} loads from outside: {match.group()}")


def setup(app: Sphinx) -> None:
    """Register what this site adds to Sphinx."""
    app.add_directive("public-names", PublicNames)
    app.add_directive("modules", Modules)
    app.add_source_suffix(".py", "example")
    app.add_source_parser(ExampleParser)
    app.connect("autodoc-process-docstring", escape_docstring)
    app.connect("build-finished", require_no_network)
