import pytest

from vsep import InputError
from vsep.files.results import as_json
from vsep.studies.catalogue import make_study
from vsep.studies.rows import (
    read_rows,
    require_same_study,
    row_key,
    rows_text,
    study_of_rows,
    torn_bytes,
)
from vsep.studies.study import TrialSettings
from vsep.studies.trial import failed_rows, run_trial

QUICK = ("object-only", "no-interference")
STUDY = make_study("fig-2", methods=("factorised", "no-interference"))
ROWS = failed_rows(STUDY.trial(0, 0), "on purpose") + failed_rows(STUDY.trial(0, 1), "again")


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "rows.jsonl"
    write(path, ROWS)
    return path


def test_rows_come_back_as_they_were_written(path):
    assert read_rows(path) == ROWS
    assert len({row_key(row) for row in ROWS}) == 4


@pytest.mark.parametrize(
    "torn",
    [
        b"{",
        b'{"study": "fi',
        b'{"study": "fig-2", "point_ind',
        bytes(4096),
        b'{"study": "fig-2", "point_ind' + bytes(100),
        # A page that reached the disk behind one that did not.
        bytes(512) + b'9}\n{"study": "fig-2"',
    ],
)
def test_what_stands_behind_the_last_whole_row_is_left_out_and_counted(path, torn):
    assert torn_bytes(path) == 0
    path.write_bytes(path.read_bytes() + torn)
    assert read_rows(path) == ROWS
    assert torn_bytes(path) == len(torn)


def test_a_file_that_begins_with_zeros_and_is_something_else_is_refused(tmp_path):
    path = tmp_path / "picture.ico"
    path.write_bytes(b"\0\0\1\0picture")
    with pytest.raises(InputError, match=r"picture\.ico is no row"):
        torn_bytes(path)


def test_a_row_written_twice_counts_once(path):
    with path.open("a") as file:
        file.write(rows_text(ROWS[:1]))
    assert read_rows(path) == ROWS


@pytest.mark.parametrize("text", ["my notes", "1,2\n3,4\n", '{"a": 1}\n', "[]\n", '"x"\n'])
def test_a_file_of_something_else_is_refused_and_left_as_it_is(tmp_path, text):
    path = tmp_path / "notes.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=r"notes\.txt is no row"):
        read_rows(path)
    if not text.endswith("\n"):
        with pytest.raises(InputError, match=r"notes\.txt is no row"):
            torn_bytes(path)
    assert path.read_text() == text


def test_rows_of_other_settings_are_not_mixed():
    require_same_study(ROWS, STUDY, "rows.jsonl")
    for settings in (TrialSettings(seed=2), TrialSettings(schedule="paper")):
        with pytest.raises(InputError, match=r"rows\.jsonl holds rows of"):
            require_same_study(ROWS, make_study("fig-2", settings=settings), "rows.jsonl")
    with pytest.raises(InputError, match="another point 0"):
        require_same_study(ROWS, make_study("fig-2", object_threshold_db=12.0), "rows.jsonl")
    require_same_study(ROWS, make_study("fig-4"), "rows.jsonl")


@pytest.fixture(scope="module")
def finished_rows():
    """Rows with results, of a frame of one ramp and of one of sixteen."""
    return [
        row
        for name in ("fig-2", "fig-6")
        for row in run_trial(make_study(name, methods=QUICK).trial(0, 0))
    ]


def write(path, rows):
    path.write_text(rows_text(rows))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("point_index", -1),
        ("point_index", "0"),
        ("realization", -2),
        ("method", 3),
        ("status", "perhaps"),
        ("seed", "one"),
        ("schedule", "wild"),
        ("gospa_order", 0.0),
        ("point", {}),
        ("point", {"panel": "2"}),
        ("errors", 0.5),
        ("errors", ["small"]),
        ("beat_stds", None),
        ("doppler_errors", None),
        ("misses", "none"),
        ("num_objects", None),
        ("iterations", []),
    ],
)
def test_a_row_with_a_senseless_value_is_refused_by_its_line(tmp_path, finished_rows, name, value):
    path = tmp_path / "rows.jsonl"
    write(path, finished_rows)
    assert len(read_rows(path)) == 4
    write(path, [*finished_rows[:-1], {**finished_rows[-1], name: value}])
    with pytest.raises(InputError, match=r"Line 4 of .*rows\.jsonl is no row"):
        read_rows(path)


def test_a_row_without_a_result_it_should_have_is_refused(tmp_path, finished_rows):
    path = tmp_path / "rows.jsonl"
    for name in ("errors", "termination", "num_ramps", "doppler_stds"):
        row = {key: value for key, value in finished_rows[-1].items() if key != name}
        write(path, [row])
        with pytest.raises(InputError, match="is no row"):
            read_rows(path)


def test_rows_tell_their_study():
    settings = TrialSettings(seed=5, schedule="paper", gospa_order=2.0)
    study = make_study("fig-4", methods=QUICK, settings=settings, object_threshold_db=12.0)
    rows = failed_rows(study.trial(1, 0), "on purpose") + failed_rows(study.trial(1, 3), "again")
    found = study_of_rows(rows + ROWS, "rows.jsonl")
    assert (found.name, found.methods, found.realizations) == ("fig-4", QUICK, 4)
    assert (found.settings, found.points, found.selected) == (settings, study.points, (1,))
    own = make_study("fig-4", methods=QUICK)
    assert study_of_rows(failed_rows(own.trial(0, 0), "x"), "rows.jsonl").points == own.points


def test_rows_of_no_study_of_the_catalogue_are_refused():
    with pytest.raises(InputError, match="holds no rows"):
        study_of_rows([], "rows.jsonl")
    with pytest.raises(InputError, match="study is 'fig-9'"):
        study_of_rows([{**ROWS[0], "study": "fig-9"}], "rows.jsonl")
    moved = {**ROWS[0]["point"], "snr_db": 31.0}
    with pytest.raises(InputError, match="another point 0"):
        study_of_rows([{**ROWS[0], "point": moved}], "rows.jsonl")
    with pytest.raises(InputError, match="seed 2"):
        study_of_rows([*ROWS, {**ROWS[0], "seed": 2}], "rows.jsonl")


def test_rows_of_a_version_whose_points_had_fewer_parameters_are_still_those_of_the_study(tmp_path):
    study = make_study("fig-3", methods=("object-only",), selection="6")
    path = tmp_path / "rows.jsonl"
    (row,) = run_trial(study.trial(6, 0))
    del row["point"]["filter_mismatch"], row["point"]["num_objects"]
    path.write_text(as_json(row) + "\n")
    require_same_study(read_rows(path), study, path)
    row["point"]["sir_db"] = 1.0
    with pytest.raises(InputError, match="another point 6"):
        require_same_study([row], study, path)
