"""``vsep mitigate``, and ``vsep separate`` with a mask."""

import json

import numpy as np
import pytest
from vsep_app.cli import main as cli

from vsep.files.frame import Frame, read_frame, write_frame
from vsep.mitigation.masks.detectors import detect_interference
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import MITIGATIONS, make_mitigation
from vsep.mitigation.sparse.sequence import mitigate_sequence
from vsep.mitigation.sparse.thresholding import SOFT_PRIOR, pm_ist
from vsep.presets.scenes import simulate_preset


@pytest.fixture
def frame_file(tmp_path):
    """A frame of Simulation II with its truth."""
    path = tmp_path / "frame.npz"
    options = ["--preset", "simulation-2-a", "--seed", "7", "--out", str(path)]
    assert cli.main(["simulate", *options]) == 0
    return path


def mitigated(frame_file, *options):
    folder = frame_file.parent / "cleaned"
    assert cli.main(["mitigate", str(frame_file), *options, "--out", str(folder)]) == 0
    with np.load(folder / frame_file.name) as archive:
        assert sorted(archive.files) == ["cleaned", "mask"]
        return archive["cleaned"], archive["mask"]


@pytest.mark.parametrize("name", MITIGATIONS)
def test_every_method_writes_its_cleaned_frame_and_the_mask(frame_file, name):
    cleaned, mask = mitigated(frame_file, "--method", name, "--mask", "truth")
    frame = read_frame(frame_file)
    np.testing.assert_array_equal(mask, frame.truth.perfect_mask())
    expected = mitigate(make_mitigation(name), frame.received, mask).cleaned
    np.testing.assert_array_equal(cleaned, expected)


@pytest.fixture
def drive(tmp_path):
    """Three frames of one sequence."""
    scenes = [
        simulate_preset("simulation-2-b", snr_db=60.0, sir_db=-20.0, seed=7, frame_number=number)
        for number in range(3)
    ]
    paths = [tmp_path / f"drive-{number}.npz" for number in range(3)]
    for path, (scenario, observation) in zip(paths, scenes, strict=True):
        frame = Frame(received=observation.received, radar=scenario.radar, truth=observation.truth)
        write_frame(path, frame)
    return paths


@pytest.mark.parametrize("debias", [False, True])
def test_frames_in_order_are_a_sequence_to_a_method_with_a_prior(tmp_path, drive, debias):
    out = tmp_path / "cleaned"
    options = ["--method", "pm-ist", "--out", str(out), *(["--debias"] if debias else [])]
    assert cli.main(["mitigate", *map(str, drive), *options]) == 0
    frames = [read_frame(path) for path in drive]
    expected = mitigate_sequence(
        lambda history: pm_ist(history=history, debias=debias),
        [(frame.received, frame.perfect_mask) for frame in frames],
        SOFT_PRIOR,
    )
    for path, step in zip(drive, expected, strict=True):
        with np.load(out / path.name) as archive:
            np.testing.assert_array_equal(archive["cleaned"], step.state.cleaned)
    # Frame 2 alone is another thing: the prior had something to say.
    alone = mitigate(pm_ist(debias=debias), frames[2].received, frames[2].perfect_mask).cleaned
    assert not np.array_equal(alone, step.state.cleaned)


def test_a_frame_of_another_radar_begins_a_new_sequence(tmp_path, drive, frame_arrays):
    other = tmp_path / "other.npz"
    np.savez(other, **frame_arrays(truth_mask=np.zeros((4, 32), dtype=bool)))
    out = tmp_path / "cleaned"
    paths = [str(drive[0]), str(other), str(drive[1])]
    assert cli.main(["mitigate", *paths, "--method", "pm-iht", "--out", str(out)]) == 0
    frame = read_frame(drive[1])
    alone = mitigate(make_mitigation("pm-iht"), frame.received, frame.perfect_mask).cleaned
    with np.load(out / drive[1].name) as archive:
        np.testing.assert_array_equal(archive["cleaned"], alone)


def test_masks_are_found_by_name_and_the_domain_is_a_choice(frame_file):
    options = ("--method", "ist", "--domain", "explicit-1d", "--mask", "amplitude")
    _, mask = mitigated(frame_file, *options)
    expected = detect_interference("amplitude", read_frame(frame_file).received)
    np.testing.assert_array_equal(mask, expected)


def test_the_domain_is_a_choice_that_changes_nothing_but_the_rounding(frame_file):
    cleaned, _ = mitigated(frame_file, "--method", "amp", "--domain", "explicit-1d")
    usual, _ = mitigated(frame_file, "--method", "amp")
    assert 0.0 < np.abs(cleaned - usual).max() < 1e-6 * np.abs(usual).max()


def test_masks_are_found_beside_what_stands_still(tmp_path, frame_arrays):
    # A standing object 40 dB over the noise and a burst 20 dB below it.
    rng = np.random.default_rng(3)
    draws = rng.standard_normal((2, 32, 128))
    static = 140.0 * np.exp(-2j * np.pi * 0.21 * np.arange(128))
    received = static + draws[0] + 1j * draws[1]
    burst = 14.0 * np.exp(0.05j * np.arange(20) ** 2)
    received[7, 60:80] += burst
    path = tmp_path / "standing.npz"
    np.savez(path, **frame_arrays(received=received))
    options = ("--method", "zeroing", "--mask", "amplitude", "--clutter", "remove")
    cleaned, mask = mitigated(path, *options)
    assert mask[7, 62:78].all()
    assert mask.sum() < 40
    # What stands still is put back, also where the burst was.
    assert np.abs(cleaned - static)[7, 62:78].max() < 3.0
    _, without = mitigated(path, *options[:4])
    assert not without[7, 62:78].all()


def test_the_files_own_mask_comes_before_its_truth(frame_file):
    mask = np.zeros((16, 128), dtype=bool)
    mask[:, 5] = True
    with np.load(frame_file) as archive:
        arrays = dict(archive)
    np.savez(frame_file, **arrays, truth_mask=mask)
    cleaned, found = mitigated(frame_file, "--method", "zeroing")
    np.testing.assert_array_equal(found, mask)
    np.testing.assert_array_equal(cleaned, np.where(mask, 0, arrays["received"]))


def test_signals_keep_the_sign_of_the_file(tmp_path, frame_arrays):
    arrays = frame_arrays(beat_sign=1)
    mask = np.zeros((4, 32), dtype=bool)
    mask[1, 4:9] = True
    np.savez(tmp_path / "frame.npz", **arrays, truth_mask=mask)
    cleaned, _ = mitigated(tmp_path / "frame.npz", "--method", "zeroing")
    np.testing.assert_array_equal(cleaned, np.where(mask, 0, arrays["received"]))


def test_what_cannot_be_done_ends_in_one_sentence(refused, tmp_path, frame_arrays):
    real = tmp_path / "real.npz"
    np.savez(real, **frame_arrays())
    out = str(tmp_path / "out")
    run = ("mitigate", str(real), "--out", out, "--method")
    assert "method is 'magic'" in refused(*run, "magic")
    assert "--debias is given; mca takes none" in refused(*run, "mca", "--debias")
    assert "real.npz holds neither truth_mask" in refused(*run, "zeroing", "--mask", "truth")
    assert "invalid choice: 'guess'" in refused(*run, "zeroing", "--mask", "guess")
    lost = tmp_path / "lost.npz"
    np.savez(lost, **frame_arrays(truth_mask=np.ones((4, 32), dtype=bool)))
    sentence = refused("mitigate", str(lost), "--out", out, "--method", "zeroing")
    assert sentence == f"vsep: {lost}: All 128 samples are flagged as interfered; at least one " + (
        "must be clean.\n"
    )
    for option, words in ((("--domain", "masked-2d"), "is masked-2d"), (("--debias",), "is given")):
        sentence = refused(*run, "zeroing", *option)
        assert sentence.startswith(f"vsep: {option[0]} {words}; zeroing takes none (ist, iht, ")
    own = ("mitigate", str(real), "--method", "zeroing", "--out", str(tmp_path))
    assert "would overwrite a frame" in refused(*own)
    twice = ("mitigate", str(real), str(real), "--method", "zeroing", "--out", out)
    assert "2 frames are named real" in refused(*twice)


def test_one_unreadable_frame_does_not_lose_the_others(capsys, tmp_path, frame_file):
    out = tmp_path / "out"
    arguments = ["mitigate", str(tmp_path / "none.npz"), str(frame_file), "--method", "zeroing"]
    assert cli.main([*arguments, "--out", str(out)]) == 2
    assert "none.npz does not exist" in capsys.readouterr().err
    assert (out / "frame.npz").exists()


def test_the_help_names_every_method(capsys):
    with pytest.raises(SystemExit, match="0"):
        cli.main(["mitigate", "--help"])
    said = "".join(capsys.readouterr().out.split())
    assert ",".join(MITIGATIONS) in said


@pytest.mark.parametrize("mask", ["truth", "autoregressive"])
def test_the_masked_estimator_separates_a_frame_file(tmp_path, frame_file, mask):
    results = tmp_path / "results.jsonl"
    arguments = ["separate", str(frame_file), "--out", str(results), "--estimator", "masked"]
    assert cli.main([*arguments, "--mask", mask]) == 0
    line = json.loads(results.read_text())
    assert line["termination"] == "converged"
    # Ten objects, some of which share a resolution cell.
    assert 7 <= len(line["objects"]) <= 11


def test_a_mask_without_the_masked_estimator_is_refused(refused, tmp_path, frame_file):
    arguments = ("separate", str(frame_file), "--out", str(tmp_path / "r.jsonl"), "--mask", "truth")
    assert "--mask is truth; factorised takes none (masked does)" in refused(*arguments)
