"""Reports without a display.

A report is one file that shows a run and needs neither server nor network: a page, a picture, a
document, the numbers. It holds what it was made from and can be made again. Needs
`pip install 'vsep[dashboard]'`; the same on the command line is `vsep report`.
"""

import json
from pathlib import Path

from vsep_app.cli.main import main

source = ["report", "--preset", "simulation-1", "--sir-db", "-20", "--seed", "3"]
assert main([*source, "--out", "run.json"]) == 0
assert main([*source, "--out", "run.html"]) == 0

numbers = json.loads(Path("run.json").read_text(encoding="utf-8"))
print(numbers["result"]["termination"], numbers["metrics"])
assert numbers["result"]["termination"] == "converged"
assert len(numbers["result"]["objects"]) == 1

page = Path("run.html").read_bytes()
assert main(["report", "--from", "run.html", "--out", "again.html"]) == 0
assert Path("again.html").read_bytes() == page
