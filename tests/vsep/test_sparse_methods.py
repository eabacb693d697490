"""What the compressive-sensing methods reach on Simulation II and on large frames.

Simulation II has SNR 60 dB, SIR -20 dB, the perfect mask, and bursts cut to the filter's pass band.
"""

import numpy as np
import pytest
from scipy.fft import ifft2

from tests.vsep.repair_bench import repair_scene
from tests.vsep.sparse_bench import RADAR, gap_scene
from vsep.analysis.repair import gap_error_db, windowed_error_db
from vsep.mitigation.cfar import Cfar
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.signal.spectra import hann_window

# Bursts where Table I puts them, and rolled by four ramps away from the window's edge.
SHIFTS = (0, 4)
NUM_SCENES = 30


@pytest.fixture(scope="module")
def scenes():
    return {
        shift: [repair_scene(index, shift=shift, tails=False) for index in range(NUM_SCENES)]
        for shift in SHIFTS
    }


def mean_error_db(name, scenes):
    return np.mean(
        [
            windowed_error_db(
                scene.objects, mitigate(make_mitigation(name), scene.received, scene.mask).cleaned
            )
            for scene in scenes
        ]
    )


@pytest.mark.scenario
@pytest.mark.parametrize(
    ("name", "shift", "num_scenes", "limit_db"),
    [
        ("ist", 0, NUM_SCENES, -25.5),
        ("ist", 4, NUM_SCENES, -23.5),
        ("iht", 0, NUM_SCENES, -26.5),
        ("iht", 4, NUM_SCENES, -26.0),
        ("fista", 0, NUM_SCENES, -25.0),
        ("amp", 0, NUM_SCENES, -25.5),
        # Slower; the mean of the first six is within 0.4 dB of that of all.
        ("omp", 0, 6, -26.5),
        ("omp", 4, 6, -27.0),
        ("cosamp", 0, 6, -26.0),
        ("gamp", 0, 6, -26.0),
        ("yall1", 0, 6, -25.0),
    ],
)
def test_error_of_the_windowed_frame_in_simulation_2(name, shift, num_scenes, limit_db, scenes):
    # The same scenes on every machine; rounding moves a mean of 30 by far less than the 0.05 dB.
    assert mean_error_db(name, scenes[shift][:num_scenes]) <= limit_db + 0.05


@pytest.mark.scenario
def test_hard_thresholding_by_equation_12_alone_fails(scenes):
    # -18.2 and -7.2 dB over 30 scenes, with the schedule -26.5 and -26.7.
    for shift, deficit_db in zip(SHIFTS, (4.0, 12.0), strict=True):
        some = scenes[shift][:9]
        assert mean_error_db("iht-plain", some) > mean_error_db("iht", some) + deficit_db


@pytest.mark.scenario
def test_a_tenth_lost_at_0_db_a_sample_takes_soft_thresholding_few_iterations():
    for seed in range(3):
        scene = gap_scene(seed, share=0.1, snr_db=0.0)
        final = mitigate(make_mitigation("ist"), scene.received, scene.mask)
        assert final.iteration <= 7
        assert gap_error_db(scene.objects, final.cleaned, scene.mask) <= -15.5


@pytest.mark.scenario
def test_half_lost_at_20_db_a_sample_leaves_no_false_objects():
    window = np.outer(hann_window(RADAR.num_ramps), hann_window(RADAR.num_samples))
    detector = Cfar(false_alarm_rate=1e-6)
    for seed in range(3):
        scene = gap_scene(seed, share=0.5, snr_db=20.0)
        cleaned = mitigate(make_mitigation("iht"), scene.received, scene.mask).cleaned
        assert gap_error_db(scene.objects, cleaned, scene.mask) <= -28.0
        peaks, expected = (
            detector.peaks(np.abs(ifft2(window * frame)) ** 2)
            # Without noise even side lobes of the window would stand out.
            for frame in (cleaned, np.where(scene.mask, scene.objects, scene.received))
        )
        assert num_strangers(peaks, expected) <= 1


def num_strangers(peaks, expected):
    """Peaks more than two cells away from every expected one."""
    apart = np.abs(peaks[:, None] - expected)
    apart = np.minimum(apart, np.array(RADAR.shape) - apart)
    return int(np.sum(~np.any(np.all(apart <= 2, axis=2), axis=1)))
