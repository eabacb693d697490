"""The bench: its scenes stay what they are, and methods from outside join."""

import sys

import numpy as np
import pytest

from vsep import InputError, run_trial
from vsep.bench.methods import read_method
from vsep.bench.scenes import SCENES, VERSION, bench_study, fingerprint
from vsep.bench.table import COLUMNS, bench_table
from vsep.studies.drawn_scenes import DRAWN_SCENES
from vsep.studies.study import DRAWN, GAPS
from vsep.studies.trial_scenario import simulate_trial

# Mean powers of the frames 0 and 5 of version 1: a scene that changes needs a new version.
FINGERPRINTS = {
    "simulation-1": (0.1316697018, 0.1313415555),
    "simulation-2-a": (0.0002222998335, 0.0005478985092),
    "simulation-2-b": (0.0002399342706, 0.0002696177847),
    "simulation-2-c": (3.062871864e-05, 1.468801857e-05),
    "long-bursts": (0.001054805401, 3.040521962e-06),
    "dense-bursts": (6.637198232e-05, 4.755474785e-06),
    "wrong-filter": (6.463682733e-06, 0.001526656255),
    "coloured-noise": (0.0002342415163, 4.812667903e-05),
    "ramp-edges": (0.0004268697399, 4.694001142e-05),
    "several-interferers": (0.0003453916634, 2.290985947e-05),
    "semi-real": (567529.1321, 567073.0238),
    "one-ramp-snr-20-inr+0": (4.942695182, 2.855529764),
    "one-ramp-snr-20-inr+10": (18.19919101, 21.40368021),
    "one-ramp-snr-20-inr+20": (220.4718658, 102.6788123),
    "one-ramp-snr+0-inr+0": (0.02722863941, 0.03441085218),
    "one-ramp-snr+0-inr+10": (0.1004924038, 0.1178036547),
    "one-ramp-snr+0-inr+20": (0.5611307645, 2.720518289),
}


def test_the_scenes_of_a_version_do_not_change():
    assert VERSION == 1
    study = bench_study()
    found = {
        scene.name: [
            fingerprint(simulate_trial(study.trial(index, frame)).interfered.received)
            for frame in (0, 5)
        ]
        for index, scene in enumerate(SCENES)
    }
    assert found.keys() == FINGERPRINTS.keys()
    for name, powers in FINGERPRINTS.items():
        assert found[name] == pytest.approx(powers, rel=1e-8), name


def test_every_drawn_scene_has_its_name():
    assert tuple(DRAWN_SCENES) == DRAWN


@pytest.mark.parametrize("name", [name for name in DRAWN if name != GAPS])
def test_a_drawn_frame_is_its_parts_and_the_clean_one_lacks_the_bursts(name):
    (index,) = bench_study(
        scenes=[next(scene.name for scene in SCENES if scene.point.scene == name)]
    ).point_indices
    drawn = simulate_trial(bench_study().trial(index, 1))
    truth = drawn.truth
    bursts = drawn.interfered.received - drawn.clean.received
    assert bursts == pytest.approx(truth.interference_signal, abs=1e-9 * np.abs(bursts).max())
    assert not np.any(drawn.clean.truth.interference_signal)
    energies = [np.sum(np.abs(one) ** 2) for one in (truth.object_signal, bursts)]
    ratio_db = 10.0 * np.log10(energies[0] / energies[1])
    assert ratio_db == pytest.approx(SCENES[index].point.sir_db, abs=1e-6)


def test_coloured_noise_has_the_power_of_white_noise_and_rises_towards_zero():
    (index,) = bench_study(scenes=["coloured-noise"]).point_indices
    powers = []
    for frame in range(6):
        drawn = simulate_trial(bench_study().trial(index, frame))
        noise = drawn.clean.received - drawn.truth.object_signal
        spectrum = np.abs(np.fft.ifft(noise, axis=1, norm="ortho")) ** 2
        powers.append(np.mean(spectrum, axis=0) * drawn.truth.noise_precision)
    mean = np.mean(powers, axis=0)
    # 96 ramps: four standard deviations of a mean over all bins, and of the few next to zero.
    assert np.mean(mean) == pytest.approx(1.0, abs=4.0 / np.sqrt(96 * 128 / 3.0))
    assert np.mean(mean[[0, 1, -1]]) > 5.0 * np.mean(mean[60:68])


def test_a_module_of_ones_own_brings_a_method(tmp_path, monkeypatch):
    (tmp_path / "strangers_work.py").write_text(
        "def doubled(received, mask):\n    return received + mask * received\n"
        "class Named:\n    name = 'zeroing'\n"
    )
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    own = read_method("strangers_work:doubled")
    study = bench_study(scenes=["one-ramp-snr+0-inr+10"], methods=[own, "object-only"], frames=1)
    (index,) = study.point_indices
    rows = run_trial(study.trial(index, 0))
    assert [row["method"] for row in rows] == ["doubled", "object-only"]
    assert {row["status"] for row in rows} == {"done"}
    # Twice the bursts: 6 dB less where they are.
    assert rows[0]["sinr_db"] < rows[1]["sinr_db"] - 4.0
    table = bench_table(rows).splitlines()
    assert [line.split(" | ")[1] for line in table[2:]] == ["doubled", "object-only"]
    assert table[0].count("|") == len(COLUMNS) + 4


@pytest.mark.parametrize("text", ["no_such_module:thing", "numpy:no_such_thing", "strange:"])
def test_what_cannot_be_loaded_is_said_in_a_sentence(text):
    with pytest.raises(InputError, match=r"cannot be loaded: \w+: "):
        read_method(text)


def test_unknown_scenes_are_refused():
    with pytest.raises(InputError, match="scene is 'night'; it must be one of simulation-1, "):
        bench_study(scenes=["night"])
