"""A page packed into a smaller one, which unpacks it in the browser and asks for nothing.

Most of a recorded run is the script of the drawing library and long lists of numbers; gzip makes
them a third. What says how the page was made stays as it is, so that it can be read back.
"""

import base64
import gzip
from html import escape
from string import Template

from vsep_app.assets import path


def packed_html(html: str, *, title: str, provenance: str = "") -> str:
    """Return a page that shows another one.

    Parameters
    ----------
    html : str
        The whole document.
    title : str
        Of the browser's window while it unpacks.
    provenance : str
        An element that is not packed.
    """
    content = base64.b64encode(gzip.compress(html.encode(), 9, mtime=0)).decode()
    template = Template(path("report/packed.html").read_text(encoding="utf-8"))
    return template.substitute(title=escape(title), provenance=provenance, content=content)


def unpacked_html(page: str) -> str:
    """Return the document that a page shows, the inverse of `packed_html`."""
    content = page.partition('id="vsep-packed">')[2].partition("<")[0]
    return gzip.decompress(base64.b64decode(content)).decode()
