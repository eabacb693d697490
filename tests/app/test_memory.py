"""What closed pages leave in the memory is given back."""

import ctypes
import gc
import subprocess
import sys
import weakref

import pytest
from tornado.ioloop import IOLoop
from vsep_app.server import memory

# Blocks that the C library takes from its own arenas, every other one freed: the rest is held.
CHURN = """
from vsep_app.server.memory import give_back
def resident_mb():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096 / 1e6
before = resident_mb()
blocks = [bytearray(60_000) for _ in range(4000)]
keep = blocks[-1]
del blocks[:-1]
held = resident_mb()
give_back()
print(held - before, resident_mb() - before)
"""


def has_trim():
    return hasattr(ctypes.CDLL(None), "malloc_trim")


@pytest.mark.skipif(not has_trim(), reason="not glibc")
def test_what_is_free_goes_back_to_the_system():
    done = subprocess.run(
        [sys.executable, "-c", CHURN], capture_output=True, text=True, check=True, timeout=60
    )
    held, left = map(float, done.stdout.split())
    # 240 MB were freed below a block that is still in use.
    assert held > 200.0
    assert left < 20.0


def test_memory_is_given_back_once_pages_have_left(monkeypatch):
    monkeypatch.setattr(memory, "PERIOD_MS", 10)
    monkeypatch.setattr(memory, "LOOKS", 2)
    counts, given = iter([3, 3, 2, 2, 2, 2, 0, 0, 0, 0]), []
    loop = IOLoop(make_current=False)
    monkeypatch.setattr(memory, "give_back", lambda: given.append(True))

    def num_pages():
        count = next(counts, None)
        if count is None:
            loop.add_callback(loop.stop)
            return 0
        return count

    cycle = Holder()
    cycle.itself, gone = cycle, weakref.ref(cycle)
    del cycle
    gc.disable()
    loop.add_callback(memory.begin_tidying, loop, num_pages)
    loop.start()
    # Shutting the threads down waits for them.
    loop.asyncio_loop.run_until_complete(loop.asyncio_loop.shutdown_default_executor())
    loop.close()
    gc.enable()
    assert len(given) == 4
    # What refers to itself, as pages do, is looked for once nobody is there.
    assert gone() is None


class Holder:
    """Something that refers to itself."""
