"""``vsep serve``: the dashboard."""

import argparse
import sys
from pathlib import Path

from vsep_app.cli.shared_options import add_number, integer, require_dashboard
from vsep_app.jobs.warmup import compile_everything

DESCRIPTION = "Serve the dashboard."
EXAMPLES = """\
examples:
  vsep serve --show
  vsep serve --port 8080 --classroom           for everybody in the room, up to 40 pages
  vsep serve --experiments lecture-3           with guided experiments of your own
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
        "run; /health tells how it goes",
    )
    parser.add_argument("--show", action="store_true", help="open the dashboard in the browser")
    parser.add_argument(
        "--experiments",
        type=Path,
        metavar="FOLDER",
        help="folder of your own guided experiments, one text file each",
    )


def run(options: argparse.Namespace) -> int:
    """Serve the dashboard until interrupted."""
    server = require_dashboard("vsep_app.server.main", "serve")
    sys.stderr.write("vsep: getting ready; the very first time takes a minute or more.\n")
    compile_everything()
    own = "0.0.0.0" if options.classroom else "127.0.0.1"
    server.serve(
        port=options.port,
        address=options.address or own,
        show=options.show,
        experiments=options.experiments,
        rules=server.CLASSROOM if options.classroom else None,
    )
    return 0
