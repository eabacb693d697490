"""The steps of the container, checked without a builder."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from vsep_app.cli.main import parse

from tests.app.cli.helpers import COMMAND, checkout_environment
from tests.app.raw_client import ask

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def steps() -> list[tuple[str, str]]:
    """Instructions with their arguments, lines that go on joined."""
    text = (ROOT / "assets" / "docker" / "Dockerfile").read_text()
    lines = re.sub(r"\\\n\s*", "", text).splitlines()
    return [
        (name, rest)
        for name, _, rest in (line.partition(" ") for line in lines)
        if name and name != "#"
    ]


def of(steps: list[tuple[str, str]], name: str) -> list[str]:
    return [rest for each, rest in steps if each == name]


def test_what_is_copied_exists_and_is_all_that_an_installation_reads(
    steps: list[tuple[str, str]],
) -> None:
    copied = [source for rest in of(steps, "COPY") for source in rest.split()[:-1]]
    assert [source for source in copied if not (ROOT / source).exists()] == []
    assert set(copied) >= {"pyproject.toml", "README.md", "LICENSE", "vsep", "app", "assets"}


def test_it_installs_as_the_readme_says_and_compiles_the_installed_kernels(
    steps: list[tuple[str, str]],
) -> None:
    (line,) = re.findall(r"^pip install (.*)$", (ROOT / "README.md").read_text(), re.MULTILINE)
    runs = of(steps, "RUN")
    assert runs[0] == f"python -m pip install --no-cache-dir {line}"
    assert runs[1] == "python -m vsep_app.jobs.warmup"
    # In the folder of the sources Python would take the kernels from there.
    before = steps[: steps.index(("RUN", runs[1]))]
    assert of(before, "WORKDIR") == ["/srv/vsep", "/"]


def test_it_is_not_root_and_serves_the_network_at_the_port_that_is_asked_for_health(
    steps: list[tuple[str, str]],
) -> None:
    (user,) = of(steps, "USER")
    assert int(user) > 0
    (entry,), (command,) = of(steps, "ENTRYPOINT"), of(steps, "CMD")
    assert json.loads(entry) == ["vsep"]
    options = parse(json.loads(command))
    assert options.address == "0.0.0.0"
    assert of(steps, "EXPOSE") == [str(options.port)]
    (health,) = of(steps, "HEALTHCHECK")
    python, flag, code = json.loads(health[health.index("[") :])
    assert (python, flag) == ("python", "-c")
    compile(code, "health", "exec")
    assert f"http://127.0.0.1:{options.port}/health" in code


# Of the image's user, who can read all as there, on a root that nobody can write; like a container,
# this ends with its process. Only the folder for temporary files is writable.
CONTAINED = """
mount --make-rprivate / && mount -o remount,bind,ro / && mount -t tmpfs tmpfs "$TMPDIR" &&
exec setpriv --reuid "$0" --regid "$0" --clear-groups --inh-caps=-all,+dac_read_search \\
    --ambient-caps=-all,+dac_read_search "$@"
"""
Contained = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def contained(steps: list[tuple[str, str]], tmp_path: Path) -> Iterator[Contained]:
    """Start a program as the image does."""
    (user,) = of(steps, "USER")
    settings = dict(word.split("=") for rest in of(steps, "ENV") for word in rest.split())
    settings |= {"HOME": str(tmp_path), "TMPDIR": str(tmp_path), "VSEP_TOKEN": "of-the-container"}
    settings |= {name: os.environ[name] for name in ("PATH",) if name in os.environ}
    settings["PYTHONPATH"] = checkout_environment()["PYTHONPATH"]

    started = []

    def start(*words: str) -> "subprocess.Popen[str]":
        started.append(
            subprocess.Popen(
                ["unshare", "--mount", "sh", "-c", CONTAINED, user, *words],
                env=settings,
                cwd="/",
                text=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
            )
        )
        return started[-1]

    try:
        with start("true") as tried:
            possible = tried.wait(30) == 0
    except OSError:
        possible = False
    if not possible:
        pytest.skip("this user or system cannot make a root that nobody can write")
    yield start
    for process in started:
        process.kill()


@pytest.mark.usefixtures("compiled_kernels")
def test_another_user_on_a_read_only_root_separates_and_serves(
    contained: Contained, steps: list[tuple[str, str]], tmp_path: Path
) -> None:
    frame = f"{tmp_path}/frame.npz"
    code = (
        "import sys; from vsep_app.cli.main import main; "
        f"sys.exit(main(['simulate', '--preset', 'simulation-1', '--out', '{frame}']) or "
        f"main(['separate', '{frame}', '--out', '{tmp_path}/lines.jsonl']))"
    )
    separated = contained(sys.executable, "-c", code)
    assert (separated.communicate(timeout=120)[1], separated.returncode) == ("", 0)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    (command,) = of(steps, "CMD")
    words = [*json.loads(command)[:-1], str(port)]
    server = contained(sys.executable, "-c", COMMAND, *words)
    health = {}
    deadline = time.monotonic() + 120.0
    while health.get("status") != "ok":
        assert time.monotonic() < deadline, server.poll()
        time.sleep(0.2)
        with suppress(OSError):
            health = json.loads(ask(port, "/health").text)
    (user,) = of(steps, "USER")
    assert Path(f"/proc/{server.pid}").stat().st_uid == int(user)
    # What was compiled in the image is used; nothing is compiled anew.
    assert list(Path(f"/proc/{server.pid}/root{tmp_path}").rglob("*.nbc")) == []
    cookie = ask(port, "/?token=of-the-container").cookie
    assert "bokeh" in ask(port, "/", Cookie=cookie).text
    server.send_signal(signal.SIGTERM)
    _, said = server.communicate(timeout=60)
    assert server.returncode == 143
    assert "Traceback" not in said
