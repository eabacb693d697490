"""``vsep serve``: the dashboard."""

import argparse
import os
import re
import sys
from pathlib import Path

from vsep_app.cli.shared_options import add_number, integer, require_dashboard
from vsep_app.jobs.warmup import separate_one_frame

DESCRIPTION = "Serve the dashboard."
EXAMPLES = """\
examples:
  vsep serve --show
  vsep serve --port 8080 --classroom           for everybody in the room, up to 40 pages
  vsep serve --experiments lecture-3           with guided experiments of your own
  vsep serve --prefix vsep --allow-websocket-origin lab.example.org     behind a proxy

who gets in: whoever has the token of the printed address; `--classroom` adds a short code for the
room. The environment variable VSEP_TOKEN sets the token, which is then not printed.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    add_number(
        parser,
        "--port",
        "port to listen on, 0 for any free one (default: 5006)",
        kind=integer(0, 65535),
        default=5006,
    )
    parser.add_argument(
        "--address",
        metavar="A",
        help="address to listen on (default: 127.0.0.1, this machine only; 0.0.0.0, its network, "
        "with --classroom)",
    )
    parser.add_argument(
        "--classroom",
        action="store_true",
        help="share the machine among many: at most 40 pages, one study, 32 iterations kept of a "
        "run; a short code lets the room in; /health tells how it goes",
    )
    parser.add_argument(
        "--no-token",
        action="store_true",
        help="let in whoever reaches the address; only the token still makes its bearer the owner",
    )
    parser.add_argument(
        "--prefix",
        default="",
        metavar="FOLDER",
        type=_prefix,
        help="folder of all addresses, as `tools/vsep`, behind a proxy that keeps it",
    )
    parser.add_argument(
        "--allow-websocket-origin",
        action="append",
        default=[],
        metavar="HOST[:PORT]",
        help="further name of the server, as it stands in the browser; may be repeated",
    )
    parser.add_argument(
        "--frame-ancestor",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="site whose pages may show the dashboard in a frame, as https://lms.example.org; may "
        "be repeated",
    )
    parser.add_argument("--show", action="store_true", help="open the dashboard in the browser")
    parser.add_argument(
        "--experiments",
        type=Path,
        metavar="FOLDER",
        help="folder of your own guided experiments, one text file each",
    )


def _prefix(text: str) -> str:
    if not re.fullmatch(r"/?([\w.~-]+(/[\w.~-]+)*/?)?", text) or ".." in text:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no folder of an address; it must be words with / between them."
        )
    return text


def run(options: argparse.Namespace) -> int:
    """Serve the dashboard until interrupted."""
    server = require_dashboard("vsep_app.server.main", "serve")
    access = require_dashboard("vsep_app.server.access", "serve")
    entry = access.EntryRules(
        token=os.environ.get("VSEP_TOKEN") or None,
        with_code=options.classroom,
        open_to_all=options.no_token,
        origins=options.allow_websocket_origin,
        frame_ancestors=options.frame_ancestor,
    )
    sys.stderr.write("vsep: getting ready; the very first time takes half a minute or more.\n")
    separate_one_frame()
    own = "0.0.0.0" if options.classroom else "127.0.0.1"
    server.serve(
        port=options.port,
        address=options.address or own,
        show=options.show,
        prefix=options.prefix,
        entry=entry,
        experiments=options.experiments,
        rules=server.CLASSROOM if options.classroom else None,
    )
    return 0
