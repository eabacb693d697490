import csv
import json

import pytest
from vsep_app.cli.main import main

from vsep.studies.catalogue import CATALOGUE
from vsep.studies.rows import read_rows

HEAD = {
    *("study", "point_index", "point", "realization", "method", "version"),
    *("seed", "schedule", "gospa_cutoff", "gospa_order"),
}
QUICK = ["--estimator", "object-only", "--estimator", "no-interference"]


def study(*arguments):
    return main(["study", *map(str, arguments)])


@pytest.fixture(scope="module")
def rows_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "rows.jsonl"
    assert (
        study("run", "fig-3", "--points", "15,30", "--realizations", 2, *QUICK, "--out", path) == 0
    )
    return path


def test_the_list_names_every_study(capsys):
    assert study("list") == 0
    text = capsys.readouterr().out
    for name in ("fig-2", "fig-3", "fig-4", "fig-5", "fig-6", "separability", "false-alarms"):
        assert f"{name} " in text
    assert "500 realizations each" in text


def test_a_run_writes_its_rows_and_running_again_adds_nothing(rows_path, capsys):
    before = rows_path.read_text()
    assert len(before.splitlines()) == 8
    assert (
        study("run", "fig-3", "--points", "15,30", "--realizations", 2, *QUICK, "--out", rows_path)
        == 0
    )
    assert rows_path.read_text() == before
    assert capsys.readouterr().err == ""


def test_a_repeated_trial_gives_the_row_of_the_study(rows_path, capsys):
    assert study("run", "fig-3", "--repeat", "30,1", *QUICK) == 0
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    stored = [r for r in read_rows(rows_path) if (r["point_index"], r["realization"]) == (30, 1)]
    assert len(printed) == len(stored) == 2
    for row in (*printed, *stored):
        del row["seconds"]
    assert printed == stored


def test_a_repeated_trial_can_be_kept_as_a_frame(tmp_path, capsys):
    frame, lines = tmp_path / "frame.npz", tmp_path / "lines.jsonl"
    arguments = ["--estimator", "object-only", "--frame", frame]
    assert study("run", "fig-3", "--repeat", "30,1", *arguments) == 0
    row = json.loads(capsys.readouterr().out)
    arguments = ["--estimator", "object-only", "--object-threshold-db", "9"]
    assert main(["separate", str(frame), "--out", str(lines), *arguments]) == 0
    assert len(json.loads(lines.read_text())["objects"]) == row["num_objects"]


@pytest.mark.parametrize("suffix", ["html", "png", "svg"])
def test_a_figure_is_drawn_in_every_format(rows_path, tmp_path, suffix):
    out = tmp_path / f"figure.{suffix}"
    assert study("plot", rows_path, "--out", out) == 0
    assert out.stat().st_size > 10_000


def test_a_summary_is_a_table_with_intervals(rows_path, tmp_path):
    out = tmp_path / "summary.csv"
    assert study("summary", rows_path, "--out", out) == 0
    with out.open(newline="") as file:
        table = list(csv.DictReader(file))
    rates = [line for line in table if line["metric"] == "detection_rate"]
    assert len(rates) == 4
    assert {line["interval"] for line in rates} == {"Clopper-Pearson"}
    assert all(float(line["low"]) <= float(line["value"]) <= float(line["high"]) for line in rates)


def test_rows_that_fail_are_reported_and_kept(tmp_path, capsys, monkeypatch):
    def broken(trials, *, workers, stop, retried):
        from vsep.studies.trial import failed_rows

        assert (workers, stop) == (1, None)
        assert retried is not None
        for trial in trials:
            yield failed_rows(trial, "on purpose")

    monkeypatch.setattr("vsep.studies.engine.run_on_processes", broken)
    out = tmp_path / "rows.jsonl"
    assert study("run", "fig-2", *QUICK, "--out", out) == 0
    error = capsys.readouterr().err
    assert "point 0, realization 0, object-only: on purpose" in error
    assert f"0 of 2 rows done; 2 failed (on purpose); the rows are in {out}." in error
    assert study("plot", out, "--out", tmp_path / "figure.png") == 2
    assert "no finished trial" in capsys.readouterr().err


def test_rows_of_killed_workers_are_missing_until_the_command_is_given_again(
    rows_path, tmp_path, capsys
):
    from vsep.studies.rows import rows_text

    out = tmp_path / "rows.jsonl"
    rows = read_rows(rows_path)
    lost = [
        {**{key: value for key, value in row.items() if key in HEAD}, "status": "failed"}
        | {"reason": "the worker process ended abruptly"}
        for row in rows[:2]
    ]
    out.write_text(rows_text([*rows[2:], *lost]) + '{"study": "fig-3", "poi')
    command = ["run", "fig-3", "--points", "15,30", "--realizations", 2, *QUICK, "--out", out]
    assert study(*command) == 0
    error = capsys.readouterr().err
    assert f"{out} was cut off amid a row; its last 23 bytes are left out." in error
    assert "8 of 8 rows done" in error
    assert {row["status"] for row in read_rows(out)} == {"done"}


def test_rows_that_stay_missing_are_told_with_their_reasons_and_what_to_type(
    tmp_path, capsys, monkeypatch
):
    def without_memory(trials, _attempts, **_):
        from vsep.studies.trial import failed_rows

        for trial in trials:
            yield trial, failed_rows(trial, "MemoryError: none left")

    monkeypatch.setattr("vsep.studies.engine._run", without_memory)
    out = tmp_path / "rows of today.jsonl"
    assert study("run", "fig-2", *QUICK, "--out", out) == 3
    error = capsys.readouterr().err
    summary = "0 of 2 rows done; 2 failed (MemoryError: none left); 4 retried; the rows are in"
    assert summary in error
    typed = f"vsep study run fig-2 {' '.join(QUICK)} --out '{out}'"
    assert error.endswith(f"2 rows are missing; to go on, type: {typed}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "fig-9", "--out", "x.jsonl"], "study is 'fig-9'"),
        (["run", "fig-2"], "--out is missing"),
        (["run", "fig-2", "--out", "nowhere/x.jsonl"], "nowhere is no folder"),
        (["run", "fig-2", "--repeat", "1;2"], "--repeat is '1;2'"),
        (["run", "fig-2", "--repeat", "7,0"], "point is 7"),
        (
            ["run", "fig-2", "--frame", "x.npz", "--out", "x.jsonl"],
            "--frame is x.npz; a whole study takes none (--repeat does)",
        ),
        (["run", "fig-2", "--repeat", "0,0", "--frame", "no/x.npz"], "no is no folder"),
        (["run", "fig-2", "--repeat", "0,0", "--workers", "2"], "--workers is 2; --repeat takes"),
        (["run", "fig-2", "--estimator", "magic", "--out", "x.jsonl"], "method is 'magic'"),
        (["run", "fig-2", "--realizations", "0", "--out", "x.jsonl"], "realizations is 0"),
        (["run", "fig-2", "--workers", "0", "--out", "x.jsonl"], "workers is 0"),
        (["run", "fig-2", "--seed", "-1", "--out", "x.jsonl"], "seed is -1"),
        (["run", "fig-3", "--points", "9z", "--out", "x.jsonl"], "'9z'"),
        (["run", "fig-2", "--gospa-cutoff", "nan", "--out", "x.jsonl"], "cutoff is nan"),
        (["run", "fig-2", "--object-threshold-db", "-5", "--repeat", "0,0"], "threshold_db is -5"),
        (["plot", "absent.jsonl", "--out", "x.png"], "absent.jsonl"),
        (["plot", "empty.jsonl", "--out", "x.png"], "holds no rows"),
        (["plot", "notes.txt", "--out", "x.png"], "no row of a study"),
        (["plot", "notes.txt", "--out", "notes.txt"], "would overwrite"),
        (["summary", "empty.jsonl", "--out", "x.txt"], "must end in .csv"),
    ],
)
def test_bad_input_is_one_sentence_and_no_traceback(
    tmp_path, monkeypatch, capsys, arguments, message
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.jsonl").touch()
    (tmp_path / "notes.txt").write_text("my notes\n")
    code = study(*arguments)
    printed = capsys.readouterr()
    assert code == 2
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert "Traceback" not in printed.err


def test_a_figure_of_an_unknown_kind_is_refused(rows_path, tmp_path, capsys):
    assert study("plot", rows_path, "--out", tmp_path / "figure.gif") == 2
    assert "must end in .html, .png, .svg or .pdf" in capsys.readouterr().err


def test_a_schedule_that_no_method_takes_is_refused(tmp_path, capsys):
    out = tmp_path / "rows.jsonl"
    assert study("run", "fig-2", *QUICK, "--schedule", "paper", "--out", out) == 2
    assert capsys.readouterr().err == (
        "vsep: --schedule is paper; object-only and no-interference take none "
        "(factorised, joint and evidence do).\n"
    )
    assert not out.exists()


def test_the_help_names_every_study(capsys):
    with pytest.raises(SystemExit, match="0"):
        study("run", "--help")
    said = "".join(capsys.readouterr().out.split())
    assert ",".join(CATALOGUE) in said
    assert "--repeat" in said


def test_a_setting_of_all_points_can_be_another(capsys):
    words = ["run", "mru-solver", "--repeat", "26,0", "--estimator", "ist"]
    assert study(*words, "--set", "step_width=0.5", "--set", "threshold=falling") == 0
    (row,) = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert (row["point"]["step_width"], row["point"]["threshold"]) == (0.5, "falling")
    assert study("run", "fig-2", "--repeat", "0,0", "--set", "interference_threshold_db=6") == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert {row["point"]["interference_threshold_db"] for row in rows} == {6}


@pytest.mark.parametrize(
    ("text", "said"),
    [("step_width", "it must be NAME=VALUE"), ("panel=x", "A setting of the points is 'panel'")],
)
def test_what_is_no_setting_is_refused(text, said, capsys):
    assert study("run", "mru-solver", "--repeat", "0,0", "--set", text) == 2
    assert said in capsys.readouterr().err
