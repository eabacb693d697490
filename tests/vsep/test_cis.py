"""Points on the unit circle against the library's exponential."""

import numpy as np

from vsep.kernels.cis import cis


def test_turns_are_exponentials():
    cycles = np.concatenate(
        [np.random.default_rng(1).uniform(-4.0, 4.0, 2000), np.arange(-8, 9) / 8]
    )
    found = np.array([cis(each) for each in cycles])
    # Both round 2 pi times up to four cycles: 4e-15; the polynomials add less than 1e-16.
    np.testing.assert_allclose(found, np.exp(2j * np.pi * cycles), rtol=0, atol=5e-15)
    np.testing.assert_allclose(np.abs(found), 1.0, rtol=0, atol=4e-16)


def test_quarter_turns_are_exact():
    assert [cis(each) for each in (0.0, 0.25, 0.5, 0.75)] == [1.0, 1.0j, -1.0, -1.0j]
