import numpy as np
import pytest

from vsep._arrays import InputError
from vsep.signal.clutter import moving_part, static_part


def test_bursts_and_movers_do_not_touch_what_stands_still():
    rng = np.random.default_rng(1)
    still = rng.normal(size=32) + 1j * rng.normal(size=32)
    received = np.repeat(still[None], 9, axis=0)
    received[2, 5:9] += 100.0
    received[7, 6] -= 50.0j
    np.testing.assert_array_equal(static_part(received), still[None])


def test_antennas_are_independent():
    rng = np.random.default_rng(2)
    received = rng.normal(size=(3, 9, 4)) + 1j * rng.normal(size=(3, 9, 4))
    np.testing.assert_array_equal(static_part(received)[1], static_part(received[1]))


def test_what_moves_is_left_and_a_few_ramps_do_not_tell():
    rng = np.random.default_rng(3)
    mover = np.zeros((9, 4), complex)
    mover[3] = 5.0
    still = np.repeat(rng.normal(size=(1, 4)) + 0.5j, 9, axis=0)
    np.testing.assert_allclose(moving_part(mover + still, "a.npz"), mover, atol=1e-14)
    with pytest.raises(InputError, match=r"a.npz has 7 ramps; .* at least 8"):
        moving_part(still[:7], "a.npz")
