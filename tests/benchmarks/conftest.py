"""What `make bench` prints at its end: every part with its ratio to the reference, and growth."""

import time
from collections import defaultdict

import numpy as np
import pytest


@pytest.fixture
def timed(benchmark):
    """Time a function as a part of the table, or as one point of a curve of growth."""

    def run(function, *, part, way="fast", rounds=None, floor=None, **info):
        benchmark.extra_info |= {"part": part, "way": way} | info
        if rounds is None:
            return benchmark(function)
        warmup_rounds = info.get("frames", 1) if way == "fast" else 0
        seconds = []

        def time_floor():
            """What a user picks instead, by turns with the function."""
            start = time.perf_counter()
            floor()
            seconds.append(time.perf_counter() - start)

        result = benchmark.pedantic(
            function,
            setup=None if floor is None else time_floor,
            rounds=rounds,
            warmup_rounds=warmup_rounds,
        )
        if seconds[warmup_rounds:]:  # none where nothing is timed
            benchmark.extra_info["floor"] = float(np.median(seconds[warmup_rounds:]))
        return result

    return run


def milliseconds(seconds):
    return f"{seconds * 1e3:.4g} ms" if seconds is not None else ""


def least(bench):
    """Least time of a part; of several frames, taken in turns, the median of their least times."""
    turns = np.reshape(bench.stats.data, (-1, bench.extra_info.get("frames", 1)))
    return float(np.median(turns.min(axis=0)))


def table(parts):
    """Lines of the table: the least time tells what the program needs, the median the machine.

    The floor is zeroing and two transforms of the same frames.
    """
    row = "{:46s} {:>11s} {:>11s} {:>13s} {:>6s} {:>10s} {:>6s}".format
    lines = [row("part", "median", "least", "reference", "ratio", "floor", "times")]
    for part, ways in parts.items():
        fast, slow = ways["fast"].stats, ways.get("reference")
        reference = slow.stats.median if slow else None
        ratio = f"{reference / fast.median:.1f}" if slow else ""
        times = [milliseconds(each) for each in (fast.median, least(ways["fast"]), reference)]
        floor = ways["fast"].extra_info.get("floor")
        above = f"{fast.median / floor:.0f}" if floor else ""
        lines.append(row(part, *times, ratio, milliseconds(floor), above))
    return lines


def growth(curves):
    """Lines of the growth exponents: of the time an iteration takes, over the last doubling."""
    for number, benches in curves.items():
        sizes = [bench.extra_info["size"] for bench in benches]
        seconds = [least(bench) / bench.extra_info["iterations"] for bench in benches]
        exponent = np.log(seconds[-1] / seconds[-2]) / np.log(sizes[-1] / sizes[-2])
        points = zip(sizes, seconds, strict=True)
        values = ", ".join(f"{milliseconds(time)} at {size}" for size, time in points)
        yield f"growth in {number:13s} exponent {exponent:5.2f}   an iteration takes {values}"


def pytest_terminal_summary(terminalreporter, config):
    session = getattr(config, "_benchmarksession", None)
    parts, curves = defaultdict(dict), defaultdict(list)
    for bench in session.benchmarks if session else []:
        info = bench.extra_info
        if "iterations" in info:
            curves[info["part"]].append(bench)
        elif "part" in info:
            parts[info["part"]][info["way"]] = bench
    complete = {part: ways for part, ways in parts.items() if "fast" in ways}
    if complete:
        terminalreporter.section("speed")
        for line in [*table(complete), "", *growth(curves)]:
            terminalreporter.write_line(line)
