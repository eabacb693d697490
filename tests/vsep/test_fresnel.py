"""The smooth part of the Fresnel integral against SciPy's integrals."""

import numpy as np
from scipy.special import fresnel

from vsep.kernels.fresnel import SMOOTH, fresnel_tail


def test_the_tail_of_the_integral_is_a_phase_times_the_smooth_part():
    distances = np.concatenate([[0.0], np.geomspace(1e-6, 1e3, 4000)])
    sine, cosine = fresnel(distances)
    rest = 0.5 + 0.5j - (cosine + 1j * sine)
    smooth = np.array([fresnel_tail(each, SMOOTH) for each in distances])
    phase = np.exp(0.5j * np.pi * distances**2)
    # SciPy's own values have 1e-15; the phase x^2 pi / 2 rounds to x^2 / 2 times 2e-16 of W < 1/x.
    assert np.all(np.abs(phase * smooth - rest) < 2e-15 + 2e-16 * distances)


def test_far_away_only_the_first_term_is_left():
    # W(x) = j / (pi x) (1 + O(x^-2))
    assert abs(fresnel_tail(1e5, SMOOTH) * np.pi * 1e5 - 1j) < 1e-9
