import csv

import pytest
from vsep_app.cli.main import main

from vsep.separability import cells
from vsep.studies.trial import failed_rows, run_trial

AXES = ["--x", "sir_db=-40:0:3", "--y", "slope_difference=-2e12:-5e11:2"]


def separability(*arguments):
    return main(["separability", *map(str, arguments)])


def in_this_process(trials, *, workers, stop):
    assert (workers, stop) == (1, None)
    return (run_trial(trial) for trial in trials)


@pytest.mark.parametrize("suffix", ["html", "png"])
def test_a_map_is_drawn(tmp_path, suffix):
    out = tmp_path / f"map.{suffix}"
    assert separability(*AXES, "--out", out) == 0
    assert out.stat().st_size > 20_000


def test_a_table_has_every_cell_with_its_trials(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(cells, "run_on_processes", in_this_process)
    out = tmp_path / "map.csv"
    tried = ["--trials", 1, "--estimator", "object-only", "--set", "snr=40", "--seed", 3]
    assert separability(*AXES, *tried, "--out", out) == 0
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert {row["snr_db"] for row in rows} == {"40.0"}
    assert {row["trials"] for row in rows} == {"1"}
    # Interference neglected: at SIR -40 dB the object is buried, at 0 dB it is not.
    assert [row["detection"] for row in rows[:3]][::2] == ["0.0", "1.0"]
    assert capsys.readouterr().err == ""


def test_trials_without_a_result_are_counted(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        cells, "run_on_processes", lambda trials, **_: (failed_rows(one, "lost") for one in trials)
    )
    assert separability(*AXES, "--trials", 2, "--out", tmp_path / "map.csv") == 0
    assert "12 trials have no result" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*AXES, "--out", "map.gif"], "must end in .html, .png, .svg, .pdf or .csv"),
        ([*AXES, "--out", "nowhere/map.csv"], "nowhere is no folder"),
        ([*AXES, "--workers", "0", "--out", "map.csv"], "workers is 0"),
        ([*AXES, "--set", "snr", "--out", "map.csv"], "must read name=number"),
        ([*AXES, "--set", "num_objects=99", "--out", "map.csv"], "num_objects is 99"),
        ([*AXES, "--estimator", "magic", "--out", "map.csv"], "method is 'magic'"),
        ([*AXES, "--schedule", "paper", "--out", "map.csv"], "a map without trials takes none"),
        (
            [
                *AXES,
                "--trials",
                "1",
                "--estimator",
                "masked",
                "--schedule",
                "paper",
                "--out",
                "m.csv",
            ],
            "--schedule is paper; masked takes none (factorised, joint and evidence do)",
        ),
        ([*AXES[:2], "--y", "sir_db=0:1:2", "--out", "map.csv"], "Both axes are sir_db"),
        ([*AXES[:2], "--y", "snr_db=0:1", "--out", "map.csv"], "name=start:stop:count"),
    ],
)
def test_bad_input_is_one_sentence(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert separability(*arguments) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1
