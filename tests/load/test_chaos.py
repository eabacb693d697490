"""Sessions go on while workers are killed, descriptors run out and the network is cut.

Left to `make test-all`; `make test` covers the pool's part in `tests/app/test_pool.py`. Ten minutes
are run by hand, see chaos.py.
"""

import asyncio
from pathlib import Path

import pytest

from tests.load.chaos import GOES_ON_S, chaos, summary
from tests.load.classroom import serving


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="looks after processes as on Linux")
def test_sessions_go_on_and_nothing_that_was_answered_is_lost():
    with serving() as (process, url):
        figures = summary(
            *asyncio.run(
                chaos(url, process.pid, sessions=2, seconds=30.0, kill_every_s=5.0, num_cuts=2)
            )
        )
    assert figures["errors"] == []
    assert figures["workers killed"] >= 4
    assert figures["health without a worker"] > 0
    assert figures["until a move is answered, longest s"] < GOES_ON_S
