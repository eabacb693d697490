"""Records of a run: read-only arrays and derived figures."""

import numpy as np
import pytest

from vsep.inference.core.state import BurstComponents, ObjectComponents
from vsep.inference.objects.sbl import ActiveSet, activation_ratio


def test_component_snr_is_the_activation_ratio_minus_one():
    gram = np.array([[1.0, 0.3j], [-0.3j, 1.0]])
    active = ActiveSet(gram, np.array([4.0 + 1j, 2.0]), np.array([0.2, 0.5]), 3.0)
    components = ObjectComponents(
        component_ids=np.arange(2),
        beats=np.zeros(2),
        dopplers=np.zeros(2),
        amplitudes=active.amplitudes,
        covariance=active.covariance,
        precisions=active.precisions,
    )
    expected = [activation_ratio(*active.flat_prior_moments(i)) - 1.0 for i in range(2)]
    np.testing.assert_allclose(components.component_snr, expected, rtol=1e-12)
    assert components.num_components == 2
    with pytest.raises(ValueError, match="read-only"):
        components.precisions[0] = 1.0


def test_burst_centre_is_where_its_frequency_is_zero():
    ramp = BurstComponents(
        ramp=0,
        start_frequency=0.5,
        slope=-0.01,
        active_bins=np.array([0, 3]),
        amplitudes=np.ones(2, dtype=complex),
        covariance=np.eye(2, dtype=complex),
        precisions=np.ones(2),
        energy=1.0,
    )
    assert ramp.centre == 50.0
    assert ramp.num_components == 2
