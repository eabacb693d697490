import numpy as np
import pytest

from vsep.studies.groups import groups, mean_assigned_errors, number, single_object_errors


def test_failed_rows_are_left_out_and_counted(frame_row):
    rows = [frame_row(0), {**frame_row(1), "status": "failed", "reason": "on purpose"}]
    (group,) = groups(rows).values()
    assert (len(group.rows), group.num_failed) == (1, 1)


def test_every_row_stands_beside_the_reference_of_its_realization(frame_row):
    rows = [frame_row(2), frame_row(0)]
    rows += [frame_row(0, "no-interference", (5e-4,)), frame_row(1, "no-interference")]
    found = groups(rows)
    group = found["fig-3", 13, "factorised"]
    assert [row["realization"] for row in group.rows] == [0, 2]
    assert group.references == (rows[2], None)
    assert group.reference_column("gospa") == pytest.approx([0.0, np.nan], nan_ok=True)
    assert group.column("sinr_db") == pytest.approx([np.nan, np.nan], nan_ok=True)


def test_two_studies_are_kept_apart(frame_row):
    found = groups([frame_row(0), frame_row(0, study="separability"), frame_row(0, point_index=2)])
    assert list(found) == [
        ("fig-3", 2, "factorised"),
        ("fig-3", 13, "factorised"),
        ("separability", 13, "factorised"),
    ]


def test_a_detection_is_nearer_than_half_a_cell_in_both_dimensions(frame_row):
    near, far = 0.49 / 256, 0.51 / 256
    rows = [frame_row(errors=(near,)), frame_row(errors=(far,)), frame_row(errors=()), None]
    errors = single_object_errors(rows)
    assert errors == pytest.approx([near, np.nan, np.nan, np.nan], nan_ok=True)
    moving = frame_row(errors=(near,), num_ramps=16, doppler_errors=[0.3 / 16])
    # Hypotenuse of 0.49 and 0.3 cells: 0.57.
    assert np.isnan(single_object_errors([moving])[0])


def test_a_frame_without_assigned_objects_has_no_mean_error(frame_row):
    (group,) = groups([frame_row(0, errors=(1e-3, 3e-3)), frame_row(1, errors=())]).values()
    assert mean_assigned_errors(group) == pytest.approx([2e-3, np.nan], nan_ok=True)


def test_null_is_no_number():
    assert np.isnan(number(None))
    assert number(3) == 3.0
