"""The guided experiments as pages without a server, and as a SCORM package."""

import re
import xml.etree.ElementTree as ET
import zipfile

import pytest
from vsep_app.cli.main import main
from vsep_app.report import course
from vsep_app.report.course import INDEX, MANIFEST, experiment_page, guide_html, manifest_xml
from vsep_app.report.packed import unpacked_html
from vsep_app.teaching.experiment import shipped_experiments

CP = "{http://www.imsproject.org/xsd/imscp_rootv1p1p2}"
ADLCP = "{http://www.adlnet.org/xsd/adlcp_rootv1p2}"
# An identifier of XML: what xs:ID takes.
IDENTIFIER = re.compile(r"[A-Za-z_][\w.-]*")


@pytest.fixture(scope="module")
def same_slope():
    """The page of the shortest run."""
    return experiment_page(next(one for one in shipped_experiments() if one.name == "same-slope"))


@pytest.fixture
def package(tmp_path, monkeypatch, same_slope):
    """A package whose pages are all that of one experiment."""
    monkeypatch.setattr(course, "experiment_page", lambda _: same_slope)
    out = tmp_path / "course.zip"
    assert main(["report", "--scorm", str(out)]) == 0
    with zipfile.ZipFile(out) as file:
        yield file


def test_a_page_has_less_than_1_mb_and_keeps_the_answer_behind_a_click(same_slope):
    assert len(same_slope.encode()) < 1_000_000
    html = unpacked_html(same_slope)
    assert "<details><summary>Answer</summary>" in html
    assert html.count('data-right="true"') == 1
    assert not re.search(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?!data:)', html)


def test_a_manifest_follows_the_rules_of_scorm_1_2(package):
    """The rules of its schemas: required elements in their order, attributes, references."""
    names = package.namelist()
    assert names[0] == MANIFEST
    root = ET.fromstring(package.read(MANIFEST))
    assert root.tag == f"{CP}manifest"
    assert [child.tag for child in root] == [
        f"{CP}{name}" for name in ("metadata", "organizations", "resources")
    ]
    metadata, organizations, resources = root
    assert [child.text for child in metadata] == ["ADL SCORM", "1.2"]
    assert [child.tag for child in metadata] == [f"{CP}schema", f"{CP}schemaversion"]
    [organization] = organizations
    assert organizations.get("default") == organization.get("identifier")
    assert organization[0].tag == f"{CP}title"
    items = organization[1:]
    assert all(item.tag == f"{CP}item" and len(item) == 1 and item[0].text for item in items)
    identifiers = [each.get("identifier") for each in root.iter() if each.get("identifier")]
    assert len(set(identifiers)) == len(identifiers)
    assert all(IDENTIFIER.fullmatch(each) for each in identifiers)
    by_name = {each.get("identifier"): each for each in resources}
    assert [item.get("identifierref") for item in items] == list(by_name)
    for resource in resources:
        assert resource.get("type") == "webcontent"
        assert resource.get(f"{ADLCP}scormtype") in ("sco", "asset")
        assert [file.get("href") for file in resource] == [resource.get("href")]
        assert resource.get("href") in names
    listed = {file.get("href") for file in resources.iter(f"{CP}file")}
    assert listed == set(names) - {MANIFEST}


def test_the_page_that_is_a_sco_speaks_to_the_platform(package):
    index = package.read(INDEX).decode()
    assert "LMSInitialize" in index
    assert "LMSFinish" in index
    for one in shipped_experiments():
        assert f'href="{one.name}.html"' in index


def test_a_folder_holds_an_index_and_a_page_of_each(tmp_path, monkeypatch, same_slope):
    monkeypatch.setattr(course, "experiment_page", lambda _: same_slope)
    assert main(["report", "--experiments", str(tmp_path / "course")]) == 0
    names = {path.name for path in (tmp_path / "course").iterdir()}
    assert names == {INDEX, *(f"{one.name}.html" for one in shipped_experiments())}


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (["--scorm", "course.tar"], "must end in .zip"),
        (["--scorm", "course.zip", "--preset", "simulation-1"], "go alone"),
    ],
)
def test_a_course_goes_alone_and_a_package_is_a_zip(more, told, capsys):
    assert main(["report", *more]) != 0
    assert told in capsys.readouterr().err


def test_texts_are_shown_as_text():
    one = shipped_experiments()[0]
    odd = type(one)(**{**one.__dict__, "title": "<b>&", "answer": "</details><script>"})
    html = guide_html(odd, None)
    assert "<b>" not in html
    assert "<script>" not in html
    ET.fromstring(manifest_xml([odd]))
