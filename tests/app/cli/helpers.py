"""What the tests of several commands use."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import vsep_app

import vsep

COMMAND = "import sys; from vsep_app.cli.main import main; sys.exit(main())"
# Whoever started the tests may have had SIGINT ignored, as `nohup make test &` in a script has; the
# process would inherit it.
INTERRUPTIBLE = (
    f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); {COMMAND}"
)


def checkout_environment() -> dict[str, str]:
    """Return an environment in which Python finds this checkout, whatever the folder."""
    parents = (Path(package.__file__ or "").parents[1] for package in (vsep, vsep_app))
    return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, parents))}


def start_process(code: str, *arguments: str, **options: Any) -> "subprocess.Popen[str]":
    """Start Python on this checkout, whatever the folder."""
    return subprocess.Popen(
        [*options.pop("before", ()), sys.executable, "-c", code, *arguments],
        env=checkout_environment(),
        text=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
    )


def lines_of(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file of JSON lines."""
    return [json.loads(line) for line in path.read_text().splitlines()]
