"""Time of masked residual updates and of whole runs; `make bench` prints the table.

The ratios hold on every machine; they are measured only where times are.
"""

import time

import numpy as np
import pytest

from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.mitigation.sparse.operators import make_operator
from vsep.mitigation.sparse.solver import residual_update


def problem(shape, domain="masked-2d"):
    """Operator, clean samples and a spectrum; a tenth of the samples is lost."""
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((2, *shape))
    frame = (draws[0] + 1j * draws[1]).astype(np.complex64)
    operator = make_operator(domain, rng.uniform(size=shape) < 0.1, np.complex64)
    measured = operator.measured(frame)
    return operator, measured, operator.adjoint(measured)


def seconds(arguments, repetitions):
    """Shortest of several times: what disturbs only ever adds."""
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        residual_update(*arguments)
        times.append(time.perf_counter() - start)
    return min(times)


@pytest.mark.benchmark(group="masked residual update")
@pytest.mark.parametrize("shape", [(64, 128), (128, 256), (256, 512)], ids=str)
def test_masked_residual_update(benchmark, shape):
    _, updated = benchmark(residual_update, *problem(shape))
    assert updated.dtype == np.complex64
    if shape == (128, 256) and benchmark.enabled:
        assert benchmark.stats.stats.min <= 1e-3


@pytest.mark.benchmark(group="masked residual update")
def test_masked_update_against_the_explicit_matrix(benchmark):
    if not benchmark.enabled:
        pytest.skip("a ratio of times, measured by `make bench`")
    shape = (128, 64)
    explicit = seconds(problem(shape, "explicit-1d"), 5)
    masked = problem(shape)
    benchmark(residual_update, *masked)
    ratio = explicit / seconds(masked, 500)
    benchmark.extra_info["times faster"] = round(ratio)
    assert ratio >= 300.0


@pytest.mark.benchmark(group="masked residual update")
def test_growth_with_the_number_of_samples(benchmark):
    if not benchmark.enabled:
        pytest.skip("a ratio of times, measured by `make bench`")
    # Below calls dominate, above the cache of the machine decides.
    shapes = [(64, 64), (64, 128), (128, 128), (128, 256), (256, 256)]
    times = [seconds(problem(shape), 300) for shape in shapes]
    benchmark(residual_update, *problem(shapes[0]))
    sizes = [rows * columns for rows, columns in shapes]
    exponent = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    benchmark.extra_info["growth exponent"] = round(float(exponent), 2)
    assert 0.85 <= exponent <= 1.2


@pytest.mark.benchmark(group="whole repair, 256 ramps of 128 samples")
@pytest.mark.parametrize("name", ["ist", "iht", "fista", "amp", "gamp", "yall1", "cosamp", "omp"])
def test_whole_repair(benchmark, name):
    ramp, sample = np.mgrid[:256, :128]
    frame = np.exp(-2j * np.pi * (0.12 * sample + 0.07 * ramp)).astype(np.complex64)
    rng = np.random.default_rng(0)
    draws = rng.standard_normal((2, *frame.shape)).astype(np.float32)
    frame += 0.1 * (draws[0] + 1j * draws[1])
    mask = (sample - rng.integers(0, 128, 256)[:, None]) % 128 < 32
    final = benchmark(mitigate, make_mitigation(name), frame, mask)
    assert np.all(np.isfinite(final.cleaned))
