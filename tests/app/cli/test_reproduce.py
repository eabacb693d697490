"""``vsep reproduce``."""

import csv

import pytest
from vsep_app.cli.main import main

from vsep.reproduction.figures import FIGURES


def test_the_list_names_every_figure_and_its_time(capsys):
    assert main(["reproduce", "--list"]) == 0
    text = capsys.readouterr().out
    assert [line.split()[0] for line in text.splitlines()[::2]] == list(FIGURES)
    assert text.count("minutes") == len(FIGURES)


@pytest.mark.slow  # `make test` runs claims, verdicts and spots: tests/vsep/test_reproduction.py
def test_a_figure_is_made_with_its_claims_and_goes_on_where_it_was(tmp_path, capsys):
    words = ["reproduce", "6", "--quick", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    out = tmp_path / "out"
    rows = (out / "rows/6.jsonl").read_text()
    page = (out / "index.html").read_text()
    assert 'src="data:image/png;base64,' in page
    assert "http" not in page.replace("http://www.w3.org", "")
    (line,) = csv.DictReader((out / "claims.csv").read_text().splitlines())
    assert (line["figure"], line["verdict"]) == ("6", "reproduced")
    assert float(line["value"]) > 10.0
    assert main(words) == 0
    assert (out / "rows/6.jsonl").read_text() == rows
    assert "the page is" in capsys.readouterr().err
