"""The estimator against Algorithm 1 written literally: two programs, one result."""

import numpy as np
import pytest

from tests.vsep.literal import LiteralSeparator
from vsep.inference.core.progress import Termination
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.uncertainty import dispersion_std
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel

RATE = 5.1e6
SHAPE = (6, 64)


def frame():
    """Two objects, one of them under the others' bursts, bursts in two ramps, unit noise."""
    model = SignalModel(
        num_ramps=SHAPE[0],
        num_samples=SHAPE[1],
        sample_rate_hz=RATE,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
    )
    rng = np.random.default_rng(3)
    factors = line_factors(np.array([0.1, 0.31]), SHAPE[1]), line_factors(np.array([0.2, -0.1]), 6)
    received = synthesize(np.array([300.0, 60.0j]), *factors)
    slopes = np.array([0.021, -0.028])
    for p, template in zip(
        (1, 4), model.template(-slopes * np.array([30.2, 40.7]), slopes), strict=True
    ):
        received[p] += 200.0 * template * (1.0 + 0.3 * np.exp(-2j * np.pi * 0.05 * np.arange(64)))
    noise = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    return model, received + noise / np.sqrt(2.0)


@pytest.mark.scenario
def test_the_literal_program_finds_the_same():
    model, received = frame()
    fast = run(FactorisedSeparator(model=model), received)
    literal = run(LiteralSeparator(model=model), received)
    assert fast.termination is literal.termination is Termination.CONVERGED
    assert [burst.ramp for burst in fast.state.bursts] == [1, 4]
    assert [burst.ramp for burst in literal.state.bursts] == [1, 4]
    assert fast.objects.num_components == literal.objects.num_components == 2
    deviation = dispersion_std(fast.objects, fast.state.noise_precision, SHAPE)
    # Both stop when nothing moves by a hundredth of its standard deviation any more.
    beats = np.abs(fast.objects.beats - literal.objects.beats) / deviation.beats
    dopplers = np.abs(fast.objects.dopplers - literal.objects.dopplers) / deviation.dopplers
    assert np.max([beats, dopplers]) < 0.01
    assert literal.state.noise_precision == pytest.approx(fast.state.noise_precision, rel=1e-3)
