"""Tables as files: what a spreadsheet and a program read is what is shown."""

import csv
import io
import json
from dataclasses import asdict

import pytest

from app.exports import download_buttons, table_csv
from app.words import LogLine, TableRow
from app.work import compose


@pytest.fixture
def picture(many_ramps):
    return compose(many_ramps.snapshot(), 0, "level")


def content(button):
    return button.callback().getvalue()


def test_csv_reads_back_as_it_was(picture):
    as_csv, _ = download_buttons("objects", TableRow, lambda: picture.table)
    rows = list(csv.DictReader(io.StringIO(content(as_csv))))
    assert len(rows) == len(picture.table) == 10
    for read, row in zip(rows, picture.table, strict=True):
        for name, value in asdict(row).items():
            assert read[name] == "" if value is None else float(read[name]) == value


def test_json_reads_back_as_it_was(picture):
    _, as_json = download_buttons("events", LogLine, lambda: picture.log)
    assert json.loads(content(as_json)) == {"events": [asdict(line) for line in picture.log]}


def test_what_json_does_not_know_is_null():
    _, as_json = download_buttons("objects", TableRow, lambda: [TableRow(range_std_m=float("nan"))])
    assert json.loads(content(as_json))["objects"][0]["range_std_m"] is None


def test_files_are_named_by_their_table_and_an_empty_one_has_its_headings():
    buttons = download_buttons("events", LogLine, list)
    assert [button.filename for button in buttons] == ["vsep-events.csv", "vsep-events.json"]
    assert content(buttons[0]) == "iteration,text,kind\n"


def test_commas_are_quoted():
    assert table_csv(["text"], [{"text": "at 1.0 m, +2.0 m/s"}]) == 'text\n"at 1.0 m, +2.0 m/s"\n'
