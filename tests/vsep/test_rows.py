import io

import pytest

from vsep import InputError
from vsep.studies.catalogue import make_study
from vsep.studies.rows import append_rows, read_rows, repair, require_same_study, row_key
from vsep.studies.study import TrialSettings
from vsep.studies.trial import failed_rows

STUDY = make_study("fig-2", methods=("factorised", "no-interference"))
ROWS = failed_rows(STUDY.trial(0, 0), "on purpose") + failed_rows(STUDY.trial(0, 1), "again")


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "rows.jsonl"
    with path.open("w") as file:
        append_rows(file, ROWS)
    return path


def test_rows_come_back_as_they_were_written(path):
    assert read_rows(path) == ROWS
    assert len({row_key(row) for row in ROWS}) == 4


@pytest.mark.parametrize("torn", ["{", '{"study": "fi', '{"study": "fig-2", "point_ind'])
def test_a_torn_last_line_is_left_out_and_cut_off(path, torn):
    whole = path.read_bytes()
    path.write_bytes(whole + torn.encode())
    assert read_rows(path) == ROWS
    repair(path)
    assert path.read_bytes() == whole


def test_repairing_a_whole_file_changes_nothing(path):
    whole = path.read_bytes()
    repair(path)
    assert path.read_bytes() == whole


def test_a_row_written_twice_counts_once(path):
    with path.open("a") as file:
        append_rows(file, ROWS[:1])
    assert read_rows(path) == ROWS


@pytest.mark.parametrize("text", ["my notes", "1,2\n3,4\n", '{"a": 1}\n', "[]\n", '"x"\n'])
def test_a_file_of_something_else_is_refused_and_left_as_it_is(tmp_path, text):
    path = tmp_path / "notes.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=r"notes\.txt is no row"):
        read_rows(path)
    if not text.endswith("\n"):
        with pytest.raises(InputError, match=r"notes\.txt is no row"):
            repair(path)
    assert path.read_text() == text


def test_rows_of_other_settings_are_not_mixed():
    require_same_study(ROWS, STUDY, "rows.jsonl")
    for settings in (TrialSettings(seed=2), TrialSettings(schedule="paper")):
        with pytest.raises(InputError, match=r"rows\.jsonl holds rows of"):
            require_same_study(ROWS, make_study("fig-2", settings=settings), "rows.jsonl")
    with pytest.raises(InputError, match="another point 0"):
        require_same_study(ROWS, make_study("fig-2", object_threshold_db=12.0), "rows.jsonl")
    require_same_study(ROWS, make_study("fig-4"), "rows.jsonl")


def test_rows_of_a_trial_are_written_in_one_go():
    class Counting(io.StringIO):
        writes = 0

        def write(self, text):
            self.writes += 1
            return super().write(text)

    file = Counting()
    append_rows(file, ROWS)
    assert file.writes == 1
    assert file.getvalue().count("\n") == 4
