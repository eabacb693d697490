"""Opening of a page: what a browser can show and fetch while the page itself is being built.

The answer to a request begins at once with a page that stands on its own: its title, the first
picture of the scene if somebody has opened it before, and the names of the scripts that will be
needed. The document follows in the same answer; what was shown goes once it is drawn.
"""

import re
from html import escape
from string import Template

import panel_material_ui as pmu

from vsep_app.assets import path
from vsep_app.pages import APART, PAGES, PageEntry
from vsep_app.server.bundles import with_version
from vsep_app.server.fonts import font_rules

_SCRIPT = re.compile(r'<script type="text/javascript" src="([^"]+)"')
# No page draws by WebGL, browsers import modules themselves, notifications are components and have
# icons of their own, and the beginning of a page has brought its icon.
_UNUSED = re.compile(
    r'<script type="text/javascript" src="[^"]*/(?:bokeh-gl|es-module-shims|notyf)\.min\.js[^"]*">'
    r"</script>"
    r'|<link rel="stylesheet" href="[^"]*/(?:font-awesome/|notyf\.min\.css)[^"]*"[^>]*>'
    r'|<link rel="icon"[^>]*>'
)
ENTRIES = (*PAGES.values(), *APART.values())
_OUTER_TAGS = re.compile(r"<!DOCTYPE html>|</?(?:html|head|body)(?:\s[^>]*)?>|<title>.*?</title>")


class Opening:
    """Beginnings of the answers of a server; it learns from each page which scripts one needs."""

    def __init__(self) -> None:
        self._scripts: dict[str, tuple[str, ...]] = {}
        self._patches = path("page/opening.js").read_text(encoding="utf-8")
        self._template = Template(path("entry/opening.html").read_text(encoding="utf-8"))
        self._fonts = font_rules()
        self._components = pmu.Page._render_esm(True, server=True)

    def beginning(self, route: str, theme: str, first: str) -> str:
        """Return the beginning of a page.

        Parameters
        ----------
        route : str
            Path of the page.
        theme : str
            ``dark``, ``light``, or what the browser prefers.
        first : str
            First picture as HTML; empty if there is none.
        """
        page = page_at(route)
        preloads = f'<link rel="modulepreload" href="{self._components}">' + "".join(
            f'<link rel="preload" as="script" href="{source}">'
            for source in self._scripts.get(route, ())
        )
        return self._template.substitute(
            title=escape(page.title),
            name=escape(page.name),
            preloads=preloads,
            fonts=self._fonts,
            theme=theme if theme in ("dark", "light") else "",
            first=first or "<p>Loading the page.</p>",
        )

    def rest(self, route: str, html: str) -> str:
        """Return what follows of a whole page once its beginning is sent."""
        html = with_version(_UNUSED.sub("", html))
        self._scripts[route] = tuple(_SCRIPT.findall(html))
        patched = html.replace("</head>", f"<script>{self._patches}</script>", 1)
        return _OUTER_TAGS.sub("", patched) + "</body></html>"


def page_at(route: str) -> PageEntry:
    """Return the page of a route; the first one for any other."""
    return next((page for page in ENTRIES if page.route == route), PAGES["./"])
