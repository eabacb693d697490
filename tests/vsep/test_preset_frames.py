"""Frames of the presets are those that version 0.1.0 made.

A frame is compared by its inner product with the samples of cos(n), which every sample, and so
every random number behind it, has a part in. Not by its bits: processors differ in the last one.
"""

import numpy as np
import pytest

from vsep.presets.antennas import simulate_preset_antennas
from vsep.presets.registry import PRESET_NAMES
from vsep.presets.scenes import simulate_preset
from vsep.signal.filters import ButterworthFilter
from vsep.signal.linear_array import UniformLinearArray

LEVELS = {"snr_db": 40.0, "sir_db": -15.0}
OPTIONS = {
    "plain": {},
    "slope": {"interferer_slope_hz_per_s": 9.5e12},
    "offset": {"time_offset_s": 1e-7},
    "objects": {"num_objects": 12},
    "delay": {"object_delay_s": 4e-8},
    "edges": {"interference_model": "convolution-with-edges"},
    "later": {"frame_number": 2},
    "butterworth": {"anti_aliasing_filter": ButterworthFilter(cutoff_hz=1.2e6, order=4)},
}
BEFORE = {
    "simulation-1/plain/0": (1.6214258486840727 - 1.5590109043421936j),
    "simulation-1/plain/7": (-1.680842700747489 + 1.339351191322739j),
    "simulation-1/slope/7": (2.0534077326693385 - 0.7016020385037458j),
    "simulation-1/offset/7": (-7.175015916267917 + 1.3910025302745892j),
    "simulation-1/objects/7": (-77.79419617390617 + 70.80963049711698j),
    "simulation-1/delay/7": (-1.6503689456073536 + 1.3840222906879867j),
    "simulation-1/ramps/7": (-1.680842700747489 + 1.339351191322739j),
    "simulation-1/edges/7": (-1.6767871735260402 + 1.33652041274822j),
    "simulation-1/later/7": (-1.6933103437692538 + 1.1694617789099722j),
    "simulation-1/butterworth/7": (1.6674112330709614 - 1.255691207374261j),
    "simulation-1/plain/7/i": (-1.703007873598931 + 1.3207828083475663j),
    "simulation-1/antennas": (1.430913655357894 + 8.86642769869896j),
    "simulation-2-a/plain/0": (0.10634796896587564 - 0.10792071276024227j),
    "simulation-2-a/plain/7": (0.026096780210181428 - 0.3588547167920062j),
    "simulation-2-a/slope/7": (0.2895036867441116 + 0.03841286075137582j),
    "simulation-2-a/offset/7": (-0.24455903831971781 + 0.6032359048676665j),
    "simulation-2-a/objects/7": (0.026001624072326868 - 0.35906510945165054j),
    "simulation-2-a/delay/7": (0.026128668184586083 - 0.35940837218178545j),
    "simulation-2-a/ramps/7": (-0.5338867212935821 - 0.4987910190037312j),
    "simulation-2-a/edges/7": (0.03483989555871654 - 0.38606419594987645j),
    "simulation-2-a/later/7": (0.035720632500908886 - 0.3399818133105861j),
    "simulation-2-a/butterworth/7": (-0.2797920715361129 + 0.27369167810585326j),
    "simulation-2-a/plain/7/i": (0.033741896599330246 - 0.3603956698470945j),
    "simulation-2-a/antennas": (0.0303874156215697 + 0.03987162327705574j),
    "simulation-2-b/plain/0": (0.09022493820132879 - 0.027760026125492072j),
    "simulation-2-b/plain/7": (0.10417663207586325 - 0.217623274957043j),
    "simulation-2-b/slope/7": (0.19666741506663135 + 0.469420414523139j),
    "simulation-2-b/offset/7": (-0.024925383000652897 + 0.022425090454090413j),
    "simulation-2-b/objects/7": (0.10413329001237513 - 0.21773994591697565j),
    "simulation-2-b/delay/7": (0.10432527517938973 - 0.21796574276342523j),
    "simulation-2-b/ramps/7": (0.028488997621842274 - 0.060645765629132556j),
    "simulation-2-b/edges/7": (0.10152674851786561 - 0.2127125681800707j),
    "simulation-2-b/later/7": (0.11361607900744618 - 0.19908392531994695j),
    "simulation-2-b/butterworth/7": (0.3050935071071154 + 0.3594235366592335j),
    "simulation-2-b/plain/7/i": (0.11182174846501211 - 0.21916422801213137j),
    "simulation-2-b/antennas": (0.12250967591703721 + 0.09504505071416075j),
    "simulation-2-c/plain/0": (-0.09898436995814006 + 0.06845621725064871j),
    "simulation-2-c/plain/7": (-0.14971062379106562 + 0.24296791279614524j),
    "simulation-2-c/slope/7": (0.24418232217594693 + 0.0903981061345109j),
    "simulation-2-c/offset/7": (-0.6449639226738987 + 0.0943759497580681j),
    "simulation-2-c/objects/7": (-0.14992244636318425 + 0.24315689182765624j),
    "simulation-2-c/delay/7": (-0.14994162586658127 + 0.2433141807175281j),
    "simulation-2-c/ramps/7": (0.012513456303384386 + 0.6689571779203317j),
    "simulation-2-c/edges/7": (-0.14194196652370533 + 0.23713364386503896j),
    "simulation-2-c/later/7": (-0.13967155775824713 + 0.2604194596087376j),
    "simulation-2-c/butterworth/7": (0.08053873410277065 - 0.2946565938552818j),
    "simulation-2-c/plain/7/i": (-0.14206550740191676 + 0.24142695974105705j),
    "simulation-2-c/antennas": (-0.07213911836173248 - 0.09128437700444803j),
}


def projection(frame):
    return complex(np.sum(frame.ravel() * np.cos(np.arange(frame.size))))


def frame_of(key):
    name, kind, *rest = key.split("/")
    if kind == "antennas":
        line = UniformLinearArray(num_antennas=3)
        return simulate_preset_antennas(name, line, **LEVELS, seed=5)[1].received
    ramps = {"num_interfered_ramps": 1 if name == "simulation-1" else 5}
    options = ramps if kind == "ramps" else OPTIONS[kind]
    observation = simulate_preset(name, **LEVELS, seed=int(rest[0]), **options)[1]
    return observation.truth.interference_signal if rest[1:] else observation.received


@pytest.mark.parametrize("key", BEFORE)
def test_a_frame_is_what_it_was(key):
    frame = frame_of(key)
    # Rounding of single samples, against the norm that a change of any draw would show in.
    assert abs(projection(frame) - BEFORE[key]) < 1e-9 * np.linalg.norm(frame)


def test_every_preset_of_the_paper_is_compared():
    of_paper = {name for name in PRESET_NAMES if name.startswith("simulation-")}
    assert {key.split("/")[0] for key in BEFORE} == of_paper
