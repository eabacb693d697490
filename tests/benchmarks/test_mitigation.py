"""Time of masked residual updates and of whole runs; `make bench` prints the table."""

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


@pytest.mark.benchmark(group="masked residual update")
@pytest.mark.parametrize(
    "shape", [(64, 64), (64, 128), (128, 128), (128, 256), (256, 256)], ids=str
)
def test_masked_residual_update(timed, benchmark, shape):
    arguments = problem(shape)
    size = shape[0] * shape[1]
    _, updated = timed(lambda: residual_update(*arguments), part="values masked", size=size)
    benchmark.extra_info["iterations"] = 1
    assert updated.dtype == np.complex64


@pytest.mark.benchmark(group="masked residual update")
@pytest.mark.parametrize(
    ("way", "domain", "rounds"), [("fast", "masked-2d", None), ("literal", "explicit-1d", 5)]
)
def test_masked_update_and_the_explicit_matrix(timed, way, domain, rounds):
    arguments = problem((128, 64), domain)
    part = "one masked update, 128 x 64 values"
    _, updated = timed(lambda: residual_update(*arguments), part=part, way=way, rounds=rounds)
    assert updated.dtype == np.complex64


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
