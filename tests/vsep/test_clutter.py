import numpy as np

from vsep.signal.clutter import static_part


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
