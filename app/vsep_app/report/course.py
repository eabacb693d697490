"""Guided experiments as pages that need no server: a folder with an index, or a SCORM package."""

import zipfile
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from string import Template
from xml.sax.saxutils import quoteattr

from vsep.errors import InputError
from vsep.files.writing import write_text
from vsep_app.assets import path
from vsep_app.model.picture import Picture
from vsep_app.model.settings import PLAN_NAMES
from vsep_app.report.packed import packed_html
from vsep_app.report.replay import record_html
from vsep_app.report.run import execute
from vsep_app.report.spec import ReportSpec, default_plan
from vsep_app.teaching.experiment import COMPARE, Experiment

INDEX, MANIFEST = "index.html", "imsmanifest.xml"
# Of all entries of a package, so that equal runs make equal packages.
_DATE = (1980, 1, 1, 0, 0, 0)
_ON_THE_SERVER = (
    "This experiment compares methods, which the recorded run of one of them cannot show; "
    "it opens on the compare page of the dashboard."
)


def course_pages(experiments: Sequence[Experiment]) -> dict[str, str]:
    """Return the pages of a course by file name: an index, and a recorded run of each experiment.

    Raises `InputError` if a scene cannot be computed.
    """
    pages = {f"{one.name}.html": experiment_page(one) for one in experiments}
    return {INDEX: _index_html(experiments), **pages}


def write_course(experiments: Sequence[Experiment], folder: Path) -> None:
    """Write the pages of a course into a folder, which is made if need be.

    Raises `InputError` if that is a file, `OSError` if something cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--experiments {folder} is a file; the pages need a folder.")
    folder.mkdir(parents=True, exist_ok=True)
    for name, html in course_pages(experiments).items():
        write_text(folder / name, html)


def write_package(experiments: Sequence[Experiment], out: Path) -> None:
    """Write a course as a package of SCORM 1.2, which learning platforms take.

    Raises `OSError` if the file cannot be written.
    """
    pages = course_pages(experiments)
    files = {MANIFEST: manifest_xml(experiments), **pages}
    with zipfile.ZipFile(out, "w") as package:
        for name, text in files.items():
            entry = zipfile.ZipInfo(name, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            package.writestr(entry, text)


def manifest_xml(experiments: Sequence[Experiment]) -> str:
    """Return the manifest of a package: one item for the index and one for each experiment."""
    template = Template(path("report/imsmanifest.xml").read_text(encoding="utf-8"))
    entries = [("index", "Experiments", INDEX, "sco")]
    entries += [(one.name, one.title, f"{one.name}.html", "asset") for one in experiments]
    items = "".join(
        f'\n      <item identifier="item-{name}" identifierref="resource-{name}" isvisible="true">'
        f"<title>{escape(title, quote=False)}</title></item>"
        for name, title, _, _ in entries
    )
    resources = "".join(
        f'\n    <resource identifier="resource-{name}" type="webcontent" adlcp:scormtype="{kind}" '
        f"href={quoteattr(file)}><file href={quoteattr(file)}/></resource>"
        for name, _, file, kind in entries
    )
    return template.substitute(items=items, resources=resources)


def experiment_page(experiment: Experiment) -> str:
    """Return the recorded run of an experiment with its texts, question and answer."""
    settings = experiment.settings()
    plan = replace(default_plan(settings["preset"]), **_plan_values(settings))
    run = execute(ReportSpec(plan=plan))
    html = record_html([run], guide=guide_html(experiment, run.picture()))
    return packed_html(html, title=f"vsep: {experiment.title}")


def guide_html(experiment: Experiment, picture: Picture | None) -> str:
    """Return what is asked, the outcomes to choose from, and the answer behind a click."""
    score = None if picture is None else picture.score
    parts = [f"<h2>{escape(experiment.title)}</h2>", _paragraphs(experiment.setting)]
    if experiment.page == COMPARE:
        parts.append(f"<p><em>{_ON_THE_SERVER}</em></p>")
    choices = "".join(
        f'<label><input type="radio" name="predict" '
        f'data-right="{str(score is not None and each.holds(score)).lower()}"> '
        f"{escape(each.text)}</label>"
        for each in experiment.staging.predictions
    )
    if choices and experiment.page != COMPARE:
        parts.append(
            "<fieldset><legend>Predict: how will the run end?</legend>"
            f'{choices}<output id="verdict" role="status"></output></fieldset>'
        )
    truth = picture and experiment.ask and experiment.ask.truth(picture.static_picture)
    if experiment.ask is not None and truth is not None:
        unit = f" [{experiment.ask.unit}]" if experiment.ask.unit else ""
        parts.append(
            f"<fieldset><legend>{escape(experiment.ask.text)}</legend><label>Your answer{unit} "
            f'<input type="text" inputmode="decimal" data-truth="{truth!r}" '
            f'data-tolerance="{experiment.ask.tolerance!r}"></label> '
            '<output id="verdict" role="status"></output></fieldset>'
        )
    parts += [f"<h3>Question</h3>{_paragraphs(experiment.question)}"]
    parts += [f"<details><summary>Answer</summary>{_paragraphs(experiment.answer)}</details>"]
    return f'<section class="guide">{"".join(parts)}</section>'


def _plan_values(settings: dict[str, object]) -> dict[str, object]:
    return {key: value for key, value in settings.items() if key in PLAN_NAMES and key != "preset"}


def _index_html(experiments: Sequence[Experiment]) -> str:
    items = "".join(
        f'<li><a href="{one.name}.html">{escape(one.title)}</a>{_paragraphs(one.setting)}</li>'
        for one in experiments
    )
    template = Template(path("report/course.html").read_text(encoding="utf-8"))
    style = path("report/report.css").read_text(encoding="utf-8")
    return template.substitute(style=style, items=items)


def _paragraphs(text: str) -> str:
    return "".join(f"<p>{escape(part.strip())}</p>" for part in text.split("\n\n"))
