import math

import numpy as np
import pytest

from tests.vsep.repair_bench import repair_scene
from vsep.analysis.repair import gap_error_db, mask_errors, windowed_error_db
from vsep.mitigation.blanking import zeroed
from vsep.signal.spectra import range_doppler_map


def test_windowed_error_is_the_energy_ratio_of_the_range_doppler_maps():
    # Parseval: the window's error is the energy of the windowed, unpadded map's error.
    rng = np.random.default_rng(3)
    signal, error = rng.normal(size=(2, 6, 9)) + 1j * rng.normal(size=(2, 6, 9))
    energies = [np.sum(range_doppler_map(part, 1).power) for part in (error, signal)]
    expected = 10.0 * math.log10(energies[0] / energies[1])
    assert windowed_error_db(signal, signal + error) == pytest.approx(expected, abs=1e-9)


def test_gap_error_sees_the_flagged_samples_alone():
    signal = np.ones((3, 4), dtype=complex)
    mask = np.zeros((3, 4), dtype=bool)
    mask[1, 2] = True
    cleaned = np.where(mask, 1.1, 77.0)
    assert gap_error_db(signal, cleaned, mask) == pytest.approx(-20.0, abs=1e-9)
    assert math.isnan(gap_error_db(signal, cleaned, np.zeros((3, 4), dtype=bool)))


def test_perfect_masks_have_no_errors_and_a_blind_one_misses_all():
    mask = np.array([[True, False, False]])
    assert mask_errors(mask, mask) == (0.0, 0.0)
    assert mask_errors(mask, np.zeros_like(mask)) == (1.0, 0.0)
    assert mask_errors(np.zeros_like(mask), mask) == (0.0, 1.0 / 3.0)


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("shift", "expected_db", "tolerance_db"), [(0, -10.0, 1.5), (4, -5.0, 1.0)]
)
def test_zeroing_loses_what_independent_trials_measured(shift, expected_db, tolerance_db):
    # The tolerances are those of the independent trials; 30 frames have a standard error of 0.9
    # and 0.5 dB, the three sets in turn.
    errors = []
    for index in range(30):
        scene = repair_scene(index, shift=shift, tails=False)
        errors.append(windowed_error_db(scene.objects, zeroed(scene.received, scene.mask)))
    assert np.mean(errors) == pytest.approx(expected_db, abs=tolerance_db)
