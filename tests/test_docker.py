"""The steps of the container, checked without a builder."""

import json
import re
from pathlib import Path

import pytest
from vsep_app.cli.main import parse

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
