import numpy as np
import pytest

from vsep.errors import InputError
from vsep.mitigation.blanking import blanked, blanking, zeroed
from vsep.signal.spectra import delay_spectrum

MASK = (np.abs(np.arange(64) - 30) < 8)[None]
LINE = np.exp(-2j * np.pi * 0.2 * np.arange(64))[None]


def test_blanking_without_edges_is_zeroing():
    np.testing.assert_array_equal(blanked(LINE, MASK, edge_samples=0), zeroed(LINE, MASK))


def test_soft_edges_lower_the_side_lobes_far_from_a_line():
    far = slice(0, 64)  # beats -1/2 to -1/4, a quarter of the band away from the line at 0.2
    zeroed_power, blanked_power = (
        delay_spectrum(repaired, 4).power[0, far].max()
        for repaired in (zeroed(LINE, MASK), blanked(LINE, MASK, edge_samples=8))
    )
    assert blanked_power < 0.1 * zeroed_power


def test_an_absurd_edge_is_refused():
    with pytest.raises(InputError, match="edge_samples is -1"):
        blanking(edge_samples=-1)
