"""Tables as files: what a spreadsheet and a program read is what is shown."""

import base64
import csv
import io
import json
from dataclasses import asdict

import pytest
from vsep_app.jobs.tasks import compose
from vsep_app.model.text import LogLine, TableRow
from vsep_app.widgets.download import Download
from vsep_app.widgets.exports import download_buttons, table_csv


@pytest.fixture
def picture(many_ramps):
    return compose(many_ramps.snapshot(), 0, "level")


def files(name, kind, rows):
    """What a click on each of the buttons sends to the browser, by file name."""
    download, sent = Download(), {}
    for button in download_buttons(name, kind, rows, download):
        button.clicks += 1
        file = {key: column[0] for key, column in download.source.data.items()}
        sent[file["name"]] = base64.b64decode(file["data"]).decode()
    return sent


def test_csv_reads_back_as_it_was(picture):
    sent = files("objects", TableRow, lambda: picture.table)
    rows = list(csv.DictReader(io.StringIO(sent["vsep-objects.csv"])))
    assert len(rows) == len(picture.table) == 10
    for read, row in zip(rows, picture.table, strict=True):
        for name, value in asdict(row).items():
            assert read[name] == "" if value is None else float(read[name]) == value


def test_json_reads_back_as_it_was(picture):
    sent = files("events", LogLine, lambda: picture.log)
    assert json.loads(sent["vsep-events.json"]) == {
        "events": [asdict(line) for line in picture.log]
    }


def test_what_json_does_not_know_is_null():
    sent = files("objects", TableRow, lambda: [TableRow(range_std_m=float("nan"))])
    assert json.loads(sent["vsep-objects.json"])["objects"][0]["range_std_m"] is None


def test_files_are_named_by_their_table_and_an_empty_one_has_its_headings():
    sent = files("events", LogLine, list)
    assert sent == {
        "vsep-events.csv": "iteration,text,kind,number,noun\n",
        "vsep-events.json": '{"events": []}\n',
    }


def test_the_same_content_is_sent_as_often_as_it_is_asked_for():
    download = Download()
    told = []
    download.source.on_change("data", lambda _attr, _old, new: told.append(new))
    for _ in range(2):
        download.send("a.csv", "text/csv", b"a")
    assert len(told) == 2


def test_commas_are_quoted():
    assert table_csv(["text"], [{"text": "at 1.0 m, +2.0 m/s"}]) == 'text\n"at 1.0 m, +2.0 m/s"\n'
