import numpy as np
import pytest

from vsep.mitigation.short_time import LENGTH, ShortTimeFrame


@pytest.mark.parametrize("num_samples", [1, 16, 33, 128])
def test_synthesis_is_the_adjoint_of_analysis_and_its_inverse(num_samples):
    transform = ShortTimeFrame(num_samples)
    rng = np.random.default_rng(4)
    shape = (3, transform.num_segments, LENGTH)
    ramps = rng.normal(size=(3, num_samples)) + 1j * rng.normal(size=(3, num_samples))
    spectra = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    forward = np.vdot(spectra, transform.analyse(ramps))
    backward = np.vdot(transform.synthesize(spectra), ramps)
    assert abs(forward - backward) <= 1e-12 * np.linalg.norm(spectra) * np.linalg.norm(ramps)
    np.testing.assert_allclose(transform.synthesize(transform.analyse(ramps)), ramps, atol=1e-13)


def test_single_precision_stays_single():
    transform = ShortTimeFrame(32)
    spectra = transform.analyse(np.ones((1, 32), dtype=np.complex64))
    assert spectra.dtype == np.complex64
    assert transform.synthesize(spectra).dtype == np.complex64
