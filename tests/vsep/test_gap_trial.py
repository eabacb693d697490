"""Studies of compressive sensing on sequences of frames with gaps."""

from dataclasses import replace

import numpy as np
import pytest

from vsep import InputError, make_study, run_trial
from vsep.mitigation.masks.detectors import DETECTORS
from vsep.studies.catalogue import CATALOGUE
from vsep.studies.gap_frames import gap_radar, gap_sequence
from vsep.studies.gap_trial import gap_frames
from vsep.studies.rows import read_rows, rows_text, study_of_rows, trial_of_row
from vsep.studies.study import GapPoint, point_of

STUDIES = [name for name in CATALOGUE if name.startswith("mru-")]


def row_of(method="ist", realization=0, **changes):
    study = make_study("mru-prior", methods=(method,))
    point = replace(study.points[2], **changes)
    (row,) = run_trial(replace(study.trial(2, realization), point=point))
    assert row["status"] == "done", row["reason"]
    return row


def test_a_block_of_every_ramp_holds_a_chirp_of_the_level_asked_for():
    radar = gap_radar(32, 64)
    rng = np.random.default_rng(0)
    frames = list(gap_sequence(rng, radar, share=0.25, snr_db=0.0, sir_db=-20.0, num_frames=2))
    for frame in frames:
        assert np.all(frame.mask.sum(axis=1) == 16)
        chirp = (frame.received - frame.intact)[frame.mask]
        power = np.mean(np.abs(frame.truth.object_signal) ** 2)
        assert np.abs(chirp) ** 2 == pytest.approx(100.0 * power)
        assert np.array_equal(frame.received[~frame.mask], frame.intact[~frame.mask])
    # 50 ms at 2 v / c = 5 kHz / 79 GHz: objects move by up to a cell, and all of them move.
    moved = (frames[1].truth.beats - frames[0].truth.beats) * 64
    assert np.min(np.abs(moved)) > 0.0
    assert np.max(np.abs(moved)) < 1.0


def test_the_prior_of_ones_own_sequence_helps_and_that_of_other_objects_does_not():
    plain, own, other = (
        np.mean([row_of(method, number, prior=prior)["gap_error_db"] for number in range(3)])
        for method, prior in (("ist", "own"), ("pm-ist", "own"), ("pm-ist", "other"))
    )
    # 4.9 dB in the mean of 20 scenes; a wrong prior changes at most half a dB.
    assert own < plain - 2.5
    assert other == pytest.approx(plain, abs=1.0)


def test_p_samples_drawn_from_a_ramp_are_less_than_all_that_are_clean():
    assert row_of(samples_per_ramp=8)["gap_error_db"] > row_of()["gap_error_db"] + 2.0


def test_a_small_step_width_takes_more_iterations():
    assert row_of(step_width=0.3)["iterations"] > 1.5 * row_of()["iterations"]


@pytest.mark.parametrize("threshold", ["constant", "falling"])
def test_thresholds_that_do_not_adapt_end_near_those_that_do(threshold):
    other = row_of(threshold=threshold, control=2.5)
    assert other["gap_error_db"] == pytest.approx(row_of()["gap_error_db"], abs=3.0)


def test_the_explicit_matrix_gives_the_same_error_and_takes_more_memory():
    small = {"num_ramps": 24, "num_samples": 32, "share_lost": 0.1, "snr_db": 20.0}
    matrix, masked = (row_of(**small, domain=name) for name in ("explicit-1d", "masked-2d"))
    assert matrix["gap_error_db"] == pytest.approx(masked["gap_error_db"], abs=1e-6)
    # q rows of 16 bytes a cell against one number of 8 bytes a cell.
    clean = 24 * (32 - 3)
    assert matrix["operator_megabytes"] / masked["operator_megabytes"] == pytest.approx(2 * clean)


def test_a_method_of_another_kind_says_so():
    study = make_study("mru-prior", methods=("zeroing",))
    (row,) = run_trial(study.trial(0, 0))
    assert row["status"] == "failed"
    assert "compressive sensing only" in row["reason"]


def test_rows_of_sequences_come_back_with_their_settings(tmp_path):
    study = make_study("mru-solver", methods=("iht",), changes={"step_width": 0.5})
    rows = run_trial(study.trial(25, 0))
    path = tmp_path / "rows.jsonl"
    path.write_text(rows_text(rows))
    (row,) = read_rows(path)
    assert trial_of_row(row).point == study.points[25]
    found = study_of_rows([row], path)
    assert {point.step_width for point in found.points} == {0.5}


@pytest.mark.parametrize("name", STUDIES)
def test_the_studies_have_points_of_sequences_and_settings_to_change(name):
    study = CATALOGUE[name]
    assert all(isinstance(point, GapPoint) for point in study.points)
    assert "samples_per_ramp" in study.changeable
    assert all(point_of(point.parameters()) == point for point in study.points)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"prior": "mine"}, "prior is 'mine'"),
        ({"mask": "x"}, f"mask is 'x'; it must be one of truth, {next(iter(DETECTORS))}"),
        ({"share_lost": 2.0}, "share_lost is 2"),
        ({"scene": "simulation-1"}, "A setting of the points is 'scene'"),
    ],
)
def test_what_cannot_be_set_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        make_study("mru-share", changes=changes)


def test_a_trial_draws_the_same_sequence_each_time():
    trial = make_study("mru-size").trial(0, 3)
    first, second = (gap_frames(trial)[0][-1].received for _ in range(2))
    assert np.array_equal(first, second)
