"""Time of a report from the start of its process, as a user waits for it."""

import subprocess
import sys

import pytest

SCENE = ["report", "--preset", "simulation-2-b"]
CODE = "import sys; from vsep_app.cli.main import main; sys.exit(main(sys.argv[1:]))"


def run(*arguments):
    subprocess.run([sys.executable, "-c", CODE, *map(str, arguments)], check=True, timeout=300)


# What a report holds is for the tests of reports to say; here the time of a process is taken.
@pytest.mark.slow
@pytest.mark.benchmark(group="report")
@pytest.mark.parametrize(
    ("flag", "name"),
    [("--out", "a.html"), ("--out", "a.png"), ("--record", "run.html"), ("--animate", "run.gif")],
)
def test_report_of_simulation_ii(timed, tmp_path, flag, name):
    out = tmp_path / name
    timed(lambda: run(*SCENE, flag, out), part=f"process: report {flag} {name}", rounds=1)
    assert out.stat().st_size > 0
