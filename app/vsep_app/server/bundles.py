"""Bundles of scripts without the modules that no page uses.

Panel and BokehJS bring every model that there is: editors, tables, calendars, drawings in three
dimensions, a compiler. That is more than half of their scripts, and a browser reads all of it with
every opening. A bundle is a table of modules, each of which names those that it needs. Of a bundle
in `KEPT` these modules are kept, and all that they need; every other one is empty. A page that uses
a model of an empty module fails at once, and `tests/app/test_bundles.py` knows all pages.
"""

import hashlib
import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Final

KEPT: Final[dict[str, tuple[str, ...]]] = {
    "panel.min.js": (
        "models/column",
        "models/html",
        "models/location",
        "models/react_component",
    ),
    "bokeh-widgets.min.js": ("models/widgets/markup",),
    "bokeh-tables.min.js": (),
}
"""Modules that are kept with all that they need, by bundle."""
VERSION: Final = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:8]
"""Stands in the addresses of these bundles: browsers keep what they have got for good."""

_ADDRESS: Final = re.compile(rf"({'|'.join(map(re.escape, KEPT))})\?")
_MODULE: Final = re.compile(r'^"?(\w+)"?: function _\(', re.MULTILINE)
_END: Final = re.compile(r'^\}, "?(\w+)"?, (\{.*\}), \{\}\);', re.MULTILINE)
_NEEDED: Final = re.compile(r'\b\w+\("?(?:@bokehjs/)?([\w/.-]+)"?\)')
# The compiler of components that come as source; those of all pages come compiled.
_COMPILER: Final = re.compile(r"\bgetVersion=function\(\)")


def with_version(html: str) -> str:
    """Return a page that asks for these bundles as they are here."""
    return _ADDRESS.sub(rf"\1?kept={VERSION}&", html)


def without_unused(name: str, text: str) -> str:
    """Return a bundle with its unused modules empty; one of another make is left as it is.

    Parameters
    ----------
    name : str
        Name of its file.
    text : str
        Its content.

    Examples
    --------
    >>> without_unused("other.js", "alert()")
    'alert()'
    """
    end, found = _END.search(text), list(_MODULE.finditer(text))
    names = {} if end is None else json.loads(end[2])
    if end is None or name not in KEPT or not names.keys() >= {*KEPT[name]}:
        return text
    bounds = (*(each.start() for each in found), end.start())
    modules = {each[1]: text[a:b] for each, (a, b) in zip(found, pairwise(bounds), strict=True)}

    def needed(module: str) -> set[str]:
        listed = {str(names.get(each, each)) for each in _NEEDED.findall(modules[module])}
        return listed & modules.keys()

    # The entry and the list of all models, whose other modules are empty.
    kept = {end[1], *needed(end[1])}
    wanted = [str(names[each]) for each in KEPT[name]]
    while wanted:
        module = wanted.pop()
        if module not in kept and not _COMPILER.search(modules[module]):
            kept.add(module)
            wanted += needed(module)
    parts = (modules[each[1]] if each[1] in kept else f"{each[0]}) {{}},\n" for each in found)
    return text[: bounds[0]] + "".join(parts) + text[bounds[-1] :]
