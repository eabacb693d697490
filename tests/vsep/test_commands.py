"""How many processes share the frames."""

from argparse import Namespace

import pytest
from vsep_app.cli import separate as commands


@pytest.mark.parametrize(
    ("asked", "frames", "cores", "expected"),
    [
        (None, 1, 8, 1),
        (None, 31, 8, 1),
        (None, 32, 8, 2),
        (None, 1000, 8, 8),
        (4, 1000, 8, 4),
        (4, 2, 8, 2),
    ],
)
def test_a_process_is_started_for_enough_frames(monkeypatch, asked, frames, cores, expected):
    monkeypatch.setattr(commands, "available_cores", lambda: cores)
    options = Namespace(workers=asked, frames=["frame.npz"] * frames)
    assert commands._num_workers(options) == expected
