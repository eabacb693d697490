import numpy as np
import pytest

from vsep.errors import InputError
from vsep.files.frame import Frame, read_frame, write_frame
from vsep.files.frame_mask import MASK_NAMES, frame_mask
from vsep.mitigation.masks.detectors import detect_interference
from vsep.presets.scenes import simulate_preset


@pytest.fixture(scope="module")
def simulated():
    scenario, observation = simulate_preset("simulation-2-a", snr_db=60.0, sir_db=-20.0, seed=3)
    return Frame(received=observation.received, radar=scenario.radar, truth=observation.truth)


def test_truth_comes_from_the_files_mask_before_that_of_the_simulation(simulated):
    np.testing.assert_array_equal(frame_mask(simulated), simulated.truth.perfect_mask())
    own = np.zeros(simulated.radar.shape, dtype=bool)
    own[3] = True
    given = Frame(
        received=simulated.received, radar=simulated.radar, truth=simulated.truth, truth_mask=own
    )
    np.testing.assert_array_equal(frame_mask(given, "truth"), own)


def test_without_a_truth_the_mask_is_found_by_prediction(simulated):
    real = Frame(received=simulated.received, radar=simulated.radar)
    expected = detect_interference("autoregressive", simulated.received)
    np.testing.assert_array_equal(frame_mask(real), expected)
    with pytest.raises(InputError, match="holds neither truth_mask nor the truth"):
        frame_mask(real, "truth")


@pytest.mark.parametrize("name", MASK_NAMES)
def test_every_name_gives_a_mask_of_the_frame(simulated, name):
    mask = frame_mask(simulated, name)
    assert mask.shape == simulated.radar.shape
    assert mask.any()


def test_an_unknown_name_is_refused(simulated):
    with pytest.raises(InputError, match="'guess'; it must be one of truth, amplitude"):
        frame_mask(simulated, "guess")


def test_a_mask_survives_the_file(tmp_path, small_radar):
    mask = np.zeros(small_radar.shape, dtype=bool)
    mask[1, 5:9] = True
    frame = Frame(received=np.ones(small_radar.shape), radar=small_radar, truth_mask=mask)
    write_frame(tmp_path / "frame.npz", frame)
    np.testing.assert_array_equal(read_frame(tmp_path / "frame.npz").truth_mask, mask)


@pytest.mark.parametrize("mask", [np.zeros((4, 32)), np.zeros((4, 31), dtype=bool)])
def test_a_mask_that_does_not_fit_is_refused(tmp_path, frame_arrays, mask):
    np.savez(tmp_path / "frame.npz", **frame_arrays(truth_mask=mask))
    with pytest.raises(InputError, match="truth_mask has shape"):
        read_frame(tmp_path / "frame.npz")


def test_a_mask_of_a_vector_is_a_vector(tmp_path, frame_arrays):
    arrays = frame_arrays()
    mask = np.arange(32) < 4
    np.savez(
        tmp_path / "frame.npz", **arrays | {"received": arrays["received"][0]}, truth_mask=mask
    )
    frame = read_frame(tmp_path / "frame.npz")
    np.testing.assert_array_equal(frame.truth_mask, mask[None])
    write_frame(tmp_path / "again.npz", frame)
    with np.load(tmp_path / "again.npz") as archive:
        np.testing.assert_array_equal(archive["truth_mask"], mask)
