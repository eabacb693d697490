import numpy as np

from vsep.mitigation.masks.runs import closed, extended, grown


def flags(text):
    return np.array([[letter == "x" for letter in row] for row in text.split()])


def test_growing_stays_in_its_ramp():
    np.testing.assert_array_equal(grown(flags("...x.... ........"), 2), flags(".xxxxx.. ........"))


def test_closing_fills_short_gaps_and_keeps_long_ones_and_ends():
    np.testing.assert_array_equal(
        closed(flags(".x..x...x. x........x"), 2), flags(".xxxx...x. x........x")
    )


def test_hysteresis_keeps_weak_runs_that_hold_a_strong_sample():
    np.testing.assert_array_equal(
        extended(flags("..x..... ........"), flags(".xxx.xx. ..xx....")), flags(".xxx.... ........")
    )
