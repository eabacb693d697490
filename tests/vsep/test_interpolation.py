import numpy as np

from vsep.mitigation.interpolation import interpolated, interpolated_across_ramps

ROWS, COLUMNS = np.mgrid[:5, :7]


def test_straight_lines_come_back_along_and_across_the_ramps():
    frame = 2.0 * ROWS + 3j * COLUMNS
    mask = np.zeros((5, 7), dtype=bool)
    mask[1:4, 2:4] = True
    spoiled = np.where(mask, 99.0, frame)
    np.testing.assert_allclose(interpolated(spoiled, mask), frame, atol=1e-13)
    np.testing.assert_allclose(interpolated_across_ramps(spoiled, mask), frame, atol=1e-13)


def test_a_ramp_without_a_clean_sample_comes_from_its_neighbours_or_becomes_zero():
    frame = 2.0 * ROWS + 3j * COLUMNS
    mask = np.zeros((5, 7), dtype=bool)
    mask[2] = True
    np.testing.assert_array_equal(interpolated(frame, mask)[2], 0.0)
    np.testing.assert_allclose(interpolated_across_ramps(frame, mask)[2], frame[2], atol=1e-13)


def test_what_no_ramp_can_tell_is_interpolated_along_the_ramp():
    frame = 2.0 * ROWS + 3j * COLUMNS
    mask = np.zeros((5, 7), dtype=bool)
    mask[:, 3] = True
    np.testing.assert_allclose(interpolated_across_ramps(frame, mask), frame, atol=1e-13)
