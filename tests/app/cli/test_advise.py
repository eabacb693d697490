"""``vsep advise``: the table, the map, and where there is no evidence."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from vsep_app.cli import main as cli

CFG = (
    "channelCfg 15 1 0\nadcCfg 2 2\nprofileCfg 0 77 7 3 30.6 0 0 30 1 256 10000 0 0 30\n"
    "chirpCfg 0 0 0 0 0 0 0 1\nframeCfg 0 0 128 0 100 1 0\n"
)
# Its sweep, 77 to 77.6 GHz, overlaps ours, 77.09 to 77.86 GHz; 900 MHz higher there is nothing.
OTHER = "10:72.3:77:60"


@pytest.fixture
def settings(tmp_path: Path) -> list[str]:
    """The options that say what this radar is."""
    (tmp_path / "radar.cfg").write_text(CFG)
    return ["--settings", str(tmp_path / "radar.cfg")]


def test_beside_the_other_radar_nothing_is_hit(
    settings: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "table.csv"
    tried = ["--slopes", "30", "--idle-us", "0:2:3", "--start-mhz", "0:900:2", "--out", str(out)]
    assert cli.main(["advise", *settings, "--other", OTHER, *tried]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "other radar: 10 MHz/us every 72.3 us"
    assert lines[2].startswith("present    30.000  77.0900   37.600")
    assert "0.0%    0.0%    0.00%" in lines[3]
    with open(out, encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 6
    assert [float(row["start_ghz"]) for row in rows[:3]] == pytest.approx([77.99] * 3)
    assert all(float(row["ramps_hit"]) == 0.0 for row in rows[:3])
    assert all(float(row["ramps_hit"]) > 0.3 for row in rows[3:])


def test_a_map_is_drawn(settings: list[str], tmp_path: Path) -> None:
    out = tmp_path / "map.svg"
    tried = ["--slopes", "28:32:3", "--idle-us", "0:2:3", "--out", str(out)]
    assert cli.main(["advise", *settings, "--other", "10:72.3", *tried]) == 0
    assert "</svg>" in out.read_text()


def test_what_is_missing_is_told(
    settings: list[str],
    tmp_path: Path,
    refused: Callable[..., str],
) -> None:
    assert "This radar is needed once" in refused("advise", "--other", OTHER)
    assert "No other radar is given" in refused("advise", *settings)
    assert "FIRST:LAST:COUNT is needed" in refused(
        "advise", *settings, "--other", OTHER, "--slopes", "1:2:3:4"
    )
    line = {
        "file": "a.npz",
        "radar": {
            "start_frequency_hz": 77e9,
            "slope_hz_per_s": 3e13,
            "sample_rate_hz": 1e7,
            "ramp_period_s": 4e-5,
            "num_samples": 256,
            "num_ramps": 16,
            "lowest_beat": -0.5,
        },
        "interference": [],
    }
    (tmp_path / "results.jsonl").write_text(json.dumps(line) + "\n")
    assert "holds not enough evidence" in refused("advise", str(tmp_path / "results.jsonl"))
