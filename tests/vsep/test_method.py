"""Frames and masks that no method takes."""

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.mitigation.method import checked_frame, checked_mask, mitigate
from vsep.mitigation.registry import make_mitigation

MASK = np.zeros((2, 4), dtype=bool)


@pytest.mark.parametrize(
    ("received", "message"),
    [
        (np.zeros(4), r"shape \(4,\)"),
        (np.zeros((0, 4)), r"shape \(0, 4\)"),
        (np.array([["a"]]), "type <U1"),
        (np.full((2, 4), np.nan), "NaN or infinity"),
    ],
)
def test_unusable_frames_are_refused(received, message):
    with pytest.raises(InputError, match=message):
        mitigate(make_mitigation("zeroing"), received, MASK)


@pytest.mark.parametrize("mask", [np.zeros((2, 4)), np.zeros((2, 3), dtype=bool)])
def test_unusable_masks_are_refused(mask):
    with pytest.raises(InputError, match="it must be boolean and of the frame's shape"):
        mitigate(make_mitigation("zeroing"), np.ones((2, 4)), mask)


def test_checked_arrays_are_copies_that_cannot_be_written():
    received, mask = np.ones((2, 4)), MASK.copy()
    for copy in (checked_frame(received), checked_mask(mask, received)):
        assert not copy.flags.writeable
    assert received.flags.writeable
    assert mask.flags.writeable
