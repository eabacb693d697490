"""Scripts and style sheets, packed once for all visitors.

They are most of what a page weighs. What no page uses is left out, and gzip makes the rest a
quarter of it.
"""

import gzip
from functools import lru_cache
from pathlib import Path
from typing import Any

from bokeh.server.views.multi_root_static_handler import MultiRootStaticHandler
from bokeh.server.views.static_handler import StaticHandler
from tornado.web import StaticFileHandler

from vsep_app.server.bundles import without_unused

_PACKED_SUFFIXES = {".js", ".css", ".mjs", ".svg", ".json"}
_MOST_FILES = 64


@lru_cache(maxsize=_MOST_FILES)
def packed(path: str, modified_ns: int) -> bytes:
    """Return the content of a file, of the time when it was modified, as gzip."""
    del modified_ns
    file = Path(path)
    text = without_unused(file.name, file.read_text(encoding="utf-8"))
    return gzip.compress(text.encode(), 9, mtime=0)


class PackedFiles(StaticFileHandler):
    """A static file, packed where the browser takes it so, and kept by it for good.

    What comes after the question mark in its address is another one with every version.
    """

    def get_cache_time(self, path: str, modified: Any, mime_type: str) -> int:
        """Return how long a browser keeps the file, in seconds."""
        if self.request.query:
            return self.CACHE_MAX_AGE
        return super().get_cache_time(path, modified, mime_type)

    async def get(self, path: str, include_body: bool = True) -> None:
        """Answer with the file."""
        accepted = self.request.headers.get("Accept-Encoding", "")
        whole = include_body and "Range" not in self.request.headers
        if not whole or "gzip" not in accepted or Path(path).suffix not in _PACKED_SUFFIXES:
            await super().get(path, include_body)
            return
        self.path = self.parse_url_path(path)
        absolute = self.validate_absolute_path(
            self.root, self.get_absolute_path(self.root, self.path)
        )
        if absolute is None:
            return
        self.absolute_path = absolute
        self.modified = self.get_modified_time()
        self.set_headers()
        self.set_header("Vary", "Accept-Encoding")
        if self.should_return_304():
            self.set_status(304)
            return
        content = packed(absolute, Path(absolute).stat().st_mtime_ns)
        self.set_header("Content-Encoding", "gzip")
        self.set_header("Content-Length", len(content))
        self.write(content)


class PackedBokehFiles(PackedFiles, StaticHandler):
    """Files of BokehJS."""


class PackedExtensionFiles(PackedFiles, MultiRootStaticHandler):
    """Files of Panel and its extensions."""


PACKED: dict[Any, Any] = {
    StaticHandler: PackedBokehFiles,
    MultiRootStaticHandler: PackedExtensionFiles,
}
"""Which handler stands in for which."""
