"""The documents: commands are understood and run, examples run, links resolve, versions agree."""

import argparse
import contextlib
import csv
import glob
import importlib
import io
import json
import re
import runpy
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from vsep_app.cli import main as cli
from vsep_app.teaching.experiment import read_experiment

import vsep
from vsep._version import __version__
from vsep.files.results import as_json, result_line
from vsep.recordings.settings import parse_settings, settings_values
from vsep.separability.axes import parse_axis
from vsep.studies.catalogue import make_study
from vsep.studies.trial import run_trial

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "assets" / "docs"
DOCUMENTS = [
    ROOT / "README.md",
    *sorted((ROOT / ".github").glob("*.md")),
    *sorted(DOCS.glob("*.md")),
]
EXAMPLES = sorted((DOCS / "examples").glob("*.py"))
MAX_README_LINES = 150
FENCE = re.compile(r"^```(\w+|\{[\w-]+\})?\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
# Lines of commands that are only read, not run, and why.
NOT_RUN = {
    r"vsep serve": "runs until it is stopped",
    r"vsep study run (?!.*--repeat)": "takes minutes; its points and methods are looked up",
    r"vsep bench --scenes": "starts a process: tests/app/cli/test_bench.py",
    r"vsep reproduce (?!--list)": "takes minutes: tests/app/cli/test_reproduce.py",
    r"vsep calibrate": "needs bursts in most ramps: examples/calibrate-a-receiver.py",
    r"vsep separate .*--response": "needs the response of a calibration",
    r"vsep (convert|report) (adc_data|master|slave1|radar\.npy)": "needs a raw capture: "
    "tests/vsep/test_raw_words.py",
    r"vsep watch": "follows a folder: tests/app/cli/test_watch.py",
    r"vsep advise": "needs another radar's bursts: tests/app/cli/test_advise.py",
    r"vsep report .*--animate": "draws every iteration: tests/app/test_report_animation.py",
    r"vsep report .*--record": "draws every iteration: tests/app/test_report_replay.py",
    r"vsep \w+ .*--scheduler": "needs a cluster: tests/app/cli/test_scheduler.py",
    r"vsep separability .*--trials": "takes a thousand trials: tests/app/cli/test_separability.py",
}
# Groups of entry points are named as modules are.
ENTRY_POINT_GROUPS = {"vsep.estimators", "vsep.mitigations", "vsep.presets", "vsep.readers"}
# Options of other programs that the documents name.
FOREIGN_OPTIONS = {
    "--nthreads",
    "--fail-on-warning",
    "--reopen-every",
    "--lead",
}  # of other programs


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def blocks(path: Path, *languages: str) -> list[tuple[str, str]]:
    """The fenced blocks of a document in order: language and text."""
    found = FENCE.findall(path.read_text(encoding="utf-8"))
    return [(language, text) for language, text in found if language in languages]


def prose(path: Path) -> str:
    return FENCE.sub("", path.read_text(encoding="utf-8"))


def command_lines(path: Path, program: str) -> list[str]:
    lines = [line for _, text in blocks(path, "sh") for line in text.splitlines()]
    return [line for line in lines if line.split()[:1] == [program]]


VSEP_LINES = sorted({line for path in DOCUMENTS for line in command_lines(path, "vsep")})


def parsed(line: str) -> argparse.Namespace:
    """What the command line makes of a line; a line that it refuses ends the test."""
    return cli.parse(shlex.split(line)[1:])


def help_texts(*words: str) -> dict[tuple[str, ...], str]:
    """What ``--help`` says of the command line, of every command and of those within one."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), pytest.raises(SystemExit):
        cli.main([*words, "--help"])
    texts = {words: said.getvalue()}
    _, _, listed = said.getvalue().partition("\ncommands:\n")
    for name in re.findall(r"^    ([a-z-]+)", listed, flags=re.MULTILINE):
        texts |= help_texts(*words, name)
    return texts


@pytest.mark.parametrize("line", VSEP_LINES)
def test_commands_are_understood(line: str) -> None:
    options = parsed(line)
    if line.startswith("vsep study run"):
        study = make_study(
            options.study,
            realizations=options.realizations,
            methods=tuple(options.estimator) if options.estimator else None,
            selection=options.points,
        )
        assert study.num_rows > 0
    if line.startswith("vsep separability"):
        assert parse_axis(options.x).name != parse_axis(options.y).name


def test_every_command_and_no_other_is_in_the_table() -> None:
    table = set(re.findall(r"^\| `vsep ([a-z-]+)`", (DOCS / "command-line.md").read_text(), re.M))
    assert table == {words[0] for words in help_texts() if words}


def test_options_named_in_the_text_exist() -> None:
    option_name = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
    known = {option for text in help_texts().values() for option in option_name.findall(text)}
    unknown = {
        (name_of(path), option)
        for path in DOCUMENTS
        if path.stem != "changelog"
        for code in re.findall(r"`([^`\n]+)`", prose(path))
        for option in option_name.findall(code)
        if option not in known | FOREIGN_OPTIONS
    }
    assert unknown == set()


def test_targets_of_make_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    lines = {line.split()[1] for path in DOCUMENTS for line in command_lines(path, "make")}
    named = {name for path in DOCUMENTS for name in re.findall(r"`make ([a-z-]+)`", prose(path))}
    assert {"demo", "test"} <= lines
    assert lines | named <= targets


def test_scripts_that_are_started_exist() -> None:
    lines = {line for path in DOCUMENTS for line in command_lines(path, "python")}
    assert lines
    assert [line for line in lines if not script_of(line).is_file()] == []


def script_of(line: str) -> Path:
    """Return the file that a command of Python starts, by its name or as a module."""
    _, first, *others = line.split()
    return ROOT / (f"{others[0].replace('.', '/')}.py" if first == "-m" else first)


@pytest.fixture
def supplies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that documents take for granted, of one small frame."""
    monkeypatch.chdir(tmp_path)
    scenario, observation = vsep.simulate_preset("simulation-2-a", snr_db=60, sir_db=-20, seed=7)
    frame = vsep.Frame(
        received=observation.received,
        radar=scenario.radar,
        anti_aliasing_filter=scenario.anti_aliasing_filter,
        truth=observation.truth,
    )
    (tmp_path / "night").mkdir()
    for name in ("frame.npz", "night/first.npz", "night/second.npz"):
        vsep.write_frame(name, frame)
    model = vsep.SignalModel.of_radar(frame.radar, frame.assumed_filter)
    solution = vsep.run(vsep.FactorisedSeparator(model=model), frame.received)
    line = result_line("frame.npz", solution, frame.radar)
    Path("results.jsonl").write_text(as_json(line) + "\n")
    scipy.io.savemat("recording.mat", {"adc": observation.received})
    radar = scenario.radar
    Path("radar.yaml").write_text(
        f"format: mat\nstart_frequency_hz: {radar.start_frequency_hz}\n"
        f"slope_hz_per_s: {radar.slope_hz_per_s}\nsample_rate_hz: {radar.sample_rate_hz}\n"
        f"ramp_period_s: {radar.ramp_period_s}\n"
    )
    for name, study, methods, point, realization in (
        ("fig-3", "fig-3", None, 20, 17),
        ("paper", "fig-3", ("factorised",), 20, 0),
        ("fig-3c", "fig-3", ("factorised",), 39, 0),
        ("fig-5", "fig-5", ("factorised",), 0, 0),
        ("fig-5-three-bursts", "fig-5", ("factorised",), 50, 0),
        ("fa", "false-alarms", ("factorised",), 0, 0),
        ("baselines", "baselines", ("factorised", "masked"), 0, 0),
    ):
        rows = run_trial(make_study(study, methods=methods).trial(point, realization))
        Path(f"{name}.jsonl").write_text("".join(as_json(row) + "\n" for row in rows))
    return tmp_path


def is_run(line: str) -> bool:
    return not any(re.match(pattern, line) for pattern in NOT_RUN)


def run_line(line: str) -> None:
    """Run a line of a document as the shell would, and see that it writes what it says."""
    words = [
        name
        for word in shlex.split(line)[1:]
        for name in (sorted(glob.glob(word)) if "*" in word else [word])
    ]
    assert cli.main(words) == 0, line
    out = re.search(r"--(?:out|record|frame) (\S+)", line)
    assert out is None or Path(out.group(1)).exists(), line


def run_block(language: str, text: str) -> int:
    """Run what a block holds; the number of lines and programs that were run."""
    if language == "python":
        exec(compile(text, "example", "exec"), {})
        return 1
    lines = [line for line in text.splitlines() if line.startswith("vsep ") and is_run(line)]
    for line in lines:
        run_line(line)
    return len(lines)


RUN = [
    path
    for path in DOCUMENTS
    if blocks(path, "python") or any(is_run(line) for line in command_lines(path, "vsep"))
]


@pytest.mark.scenario
@pytest.mark.usefixtures("supplies", "capsys")
@pytest.mark.parametrize("path", RUN, ids=name_of)
def test_commands_and_programs_of_a_document_run_in_their_order(path: Path) -> None:
    assert sum(run_block(language, text) for language, text in blocks(path, "sh", "python")) > 0


def test_what_is_not_run_is_still_there() -> None:
    """An exception that no line needs any more would hide one that comes later."""
    unused = [p for p in NOT_RUN if not any(re.match(p, line) for line in VSEP_LINES)]
    assert unused == []


@pytest.mark.scenario
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run_and_hold_what_they_assert(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    assert capsys.readouterr().out, "an example shows what it found"


def test_every_example_asserts_has_a_title_and_is_listed() -> None:
    listed = re.findall(r"\]\(examples/([\w-]+)\.py\)", (DOCS / "examples.md").read_text())
    assert sorted(listed) == [path.stem for path in EXAMPLES]
    assert len(EXAMPLES) >= 12
    for path in EXAMPLES:
        text = path.read_text(encoding="utf-8")
        assert re.match(r'"""[A-Z].*\.\n\n', text), f"{path.name} has no title"
        assert re.search(r"^ *assert ", text, flags=re.MULTILINE), f"{path.name} asserts nothing"


def test_settings_in_the_documents_are_read() -> None:
    settings = [
        parse_settings(settings_values(f"radar.{language}", text))
        for path in DOCUMENTS
        for language, text in blocks(path, "yaml", "json")
    ]
    assert {one.format for one in settings} == {"dca1000-xwr16xx", "mat"}


def test_the_experiment_of_the_documents_is_read(tmp_path: Path) -> None:
    ((_, text),) = blocks(DOCS / "teaching.md", "toml")
    (tmp_path / "night-drive.toml").write_text(text)
    assert read_experiment(tmp_path / "night-drive.toml").title == "Night drive"


def anchor(heading: str) -> str:
    """The anchor that a heading gets on the site and in the repository's browser."""
    text = re.sub(r"[`*]|\[|\]\([^)]*\)", "", heading).strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def anchors(path: Path) -> set[str]:
    return {anchor(found) for found in re.findall(r"^#+ (.*)$", prose(path), flags=re.MULTILINE)}


def links() -> list[tuple[Path, str]]:
    texts = [(path, prose(path)) for path in DOCUMENTS]
    texts += [(path, path.read_text(encoding="utf-8").split('"""')[1]) for path in EXAMPLES]
    return [
        (path, link)
        for path, text in texts
        for link in re.findall(r"\]\(((?!https?://|mailto:)[^)\s]+)\)", text)
    ]


def test_links_lead_to_files_and_headings() -> None:
    broken = []
    for path, link in links():
        target, _, heading = link.partition("#")
        file = (path.parent / target).resolve() if target else path
        if not file.exists() or (heading and heading not in anchors(file)):
            broken.append((name_of(path), link))
    assert broken == []
    assert len(links()) > 60


def test_every_document_is_linked_from_the_readme_or_the_site() -> None:
    reached = {(path.parent / link.partition("#")[0]).resolve() for path, link in links()}
    contents = (DOCS / "index.md").read_text()
    assert [
        path.name
        for path in DOCS.glob("*.md")
        if path.name != "index.md" and path not in reached and f"\n{path.stem}\n" not in contents
    ] == []


def test_files_and_modules_named_in_the_text_exist() -> None:
    missing = []
    for path in DOCUMENTS:
        if path.stem == "changelog":
            continue
        for name in re.findall(r"`((?:vsep|app|tests|assets)/[\w./-]+)`", prose(path)):
            if not (ROOT / name).exists():
                missing.append((name_of(path), name))
        for name in re.findall(r"`(vsep(?:_app)?(?:\.[A-Za-z_]\w*)+)`", prose(path)):
            if name not in ENTRY_POINT_GROUPS and not is_importable(name):
                missing.append((name_of(path), name))
    assert missing == []


def is_importable(name: str) -> bool:
    """Whether a dotted name is a module, or something within one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            value: object = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for part in parts[end:]:
            if not hasattr(value, part):
                return False
            value = getattr(value, part)
        return True
    return False


def test_the_reference_has_a_page_for_every_package() -> None:
    pages = " ".join(path.read_text() for path in (DOCS / "reference").glob("*.rst"))
    documented = set(re.findall(r"^\.\. modules:: (\S+)$", pages, flags=re.MULTILINE))
    packages = {f"vsep.{path.parent.name}" for path in (ROOT / "vsep").glob("*/__init__.py")}
    assert documented == {"vsep", *packages} - {"vsep.kernels"}


def test_the_readme_is_short() -> None:
    lines = (ROOT / "README.md").read_text().splitlines()
    assert len(lines) <= MAX_README_LINES
    assert lines[2].startswith("![")
    assert lines[4:8] == ["```sh", "make demo", "make test", "```"]


def test_changelog_citation_and_package_have_one_version() -> None:
    newest = re.search(r"^## (\S+)", (DOCS / "changelog.md").read_text(), flags=re.MULTILINE)
    cited = re.search(r"^version: (\S+)", (ROOT / ".github/CITATION.cff").read_text(), re.MULTILINE)
    assert newest is not None
    assert cited is not None
    assert (newest.group(1), cited.group(1)) == (__version__, __version__)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "version" in project["project"]["dynamic"]


def test_rows_lines_tables_and_reports_say_which_version_made_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    study = make_study("fig-3", methods=("object-only",), selection="30")
    (row,) = run_trial(study.trial(30, 0))
    assert row["version"] == __version__
    older = {**row, "realization": 1, "version": "0.1.0"}
    Path("rows.jsonl").write_text(as_json(row) + "\n" + as_json(older) + "\n")
    run_line("vsep study summary rows.jsonl --out summary.csv")
    run_line("vsep separability --x sir_db=-9:9:2 --y snr_db=9:30:2 --out map.csv")
    run_line("vsep report --preset simulation-1 --estimator object-only --out report.json")
    with open("summary.csv", encoding="utf-8", newline="") as file:
        assert {line["version"] for line in csv.DictReader(file)} == {f"0.1.0 {__version__}"}
    with open("map.csv", encoding="utf-8", newline="") as file:
        assert {line["version"] for line in csv.DictReader(file)} == {__version__}
    report = json.loads(Path("report.json").read_text())
    assert (report["made_with"]["vsep"], report["result"]["version"]) == (__version__,) * 2
    scenario, observation = vsep.simulate_preset("simulation-1", snr_db=30, sir_db=0, seed=1)
    model = vsep.SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    solution = vsep.run(vsep.ObjectOnlySeparator(model=model), observation.received)
    assert result_line("frame", solution, scenario.radar)["version"] == __version__
    assert np.all(np.isfinite(solution.objects.beats))
