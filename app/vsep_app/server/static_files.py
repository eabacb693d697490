"""Scripts and style sheets, packed once for all visitors.

They are most of what a page weighs, and gzip makes them a quarter of it.
"""

import gzip
from functools import lru_cache
from pathlib import Path
from typing import Any

from bokeh.server.views.multi_root_static_handler import MultiRootStaticHandler
from bokeh.server.views.static_handler import StaticHandler
from tornado.web import StaticFileHandler

_PACKED_SUFFIXES = {".js", ".css", ".mjs", ".svg", ".json"}
_MOST_FILES = 64


@lru_cache(maxsize=_MOST_FILES)
def packed(path: str, modified_ns: int) -> bytes:
    """Return the content of a file, of the time when it was modified, as gzip."""
    del modified_ns
    return gzip.compress(Path(path).read_bytes(), 9, mtime=0)


class PackedFiles(StaticFileHandler):
    """A static file, packed where the browser takes it so."""

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
