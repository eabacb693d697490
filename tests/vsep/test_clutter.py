import numpy as np
import pytest

from vsep.errors import InputError
from vsep.signal.clutter import remove_static_clutter, static_clutter


def test_bursts_and_movers_do_not_touch_what_stands_still():
    rng = np.random.default_rng(1)
    still = rng.normal(size=32) + 1j * rng.normal(size=32)
    received = np.repeat(still[None], 9, axis=0)
    received[2, 5:9] += 100.0
    received[7, 6] -= 50.0j
    np.testing.assert_array_equal(static_clutter(received), still[None])


def test_antennas_are_independent():
    rng = np.random.default_rng(2)
    received = rng.normal(size=(3, 9, 4)) + 1j * rng.normal(size=(3, 9, 4))
    np.testing.assert_array_equal(static_clutter(received)[1], static_clutter(received[1]))


def test_what_moves_is_left_and_a_few_ramps_do_not_tell():
    rng = np.random.default_rng(3)
    mover = np.zeros((9, 4), complex)
    mover[3] = 5.0
    still = np.repeat(rng.normal(size=(1, 4)) + 0.5j, 9, axis=0)
    np.testing.assert_allclose(remove_static_clutter(mover + still, "a.npz"), mover, atol=1e-14)
    with pytest.raises(InputError, match=r"a.npz has 7 ramps; .* at least 8"):
        remove_static_clutter(still[:7], "a.npz")
