"""Objects of two transmitters with Doppler division beside one interferer, over the bound.

As a script it prints the figures of `assets/docs/antennas.md`, of so many frames with and without
the interferer:

    python -m tests.vsep.division_bench 40
"""

import sys
from dataclasses import replace

import numpy as np

from vsep.analysis.angles import angle_bound_deg, object_angles
from vsep.analysis.intervals import bootstrap_interval
from vsep.analysis.map_metrics import gtnr, target_cells
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.channels import interference_paths
from vsep.presets.registry import PRESETS
from vsep.signal.doppler_division import DopplerDivision, divided_scene
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.scene import Channel, Interferer, Scene
from vsep.signal.simulate import simulate_antennas
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency
from vsep.waveforms.doppler_division import join_lines

PRESET = PRESETS["many-bursts"]
RADAR = replace(PRESET.radar, num_ramps=64, num_samples=128)
FILTER = RaisedCosineFilter(cutoff_hz=RADAR.sample_rate_hz / 4.0, rolloff=0.25)
WAVEFORM = DopplerDivision(num_transmitters=2, num_bands=3)
RECEIVERS, OBJECTS, APART_CELLS = 4, 5, 4.0
SNR_DB, SIR_DB, LEVELS_DB = 40.0, -20.0, (-20.0, 0.0)


def frame(seed, *, interfered):
    """Frame of the receivers with its truth, lines of the first transmitter first; directions."""
    rng = np.random.default_rng([seed, 1])
    points = np.empty((0, 2))
    while len(points) < OBJECTS:
        point = rng.uniform([0.02, -0.5], [0.24, 0.5])
        lines = point + np.array([[0.0, 0.0], [0.0, 1.0 / 3.0]])
        others = np.concatenate([points, points + np.array([0.0, 1.0 / 3.0])])
        cells = np.abs(wrap_frequency(lines[:, None] - others)) * RADAR.shape[::-1]
        if not len(points) or cells.max(axis=2).min() > APART_CELLS:
            points = np.vstack([points, point])
    levels = 10.0 ** (rng.uniform(*LEVELS_DB, OBJECTS) / 20.0)
    channel = Channel(
        delays_s=points[:, 0] * RADAR.sample_rate_hz / RADAR.slope_hz_per_s,
        dopplers_hz=points[:, 1] / RADAR.ramp_period_s,
        weights=levels * np.exp(2j * np.pi * rng.uniform(size=OBJECTS)),
    )
    angles_deg = rng.uniform(-50.0, 50.0, OBJECTS)
    # It crosses the band in the middle of every ramp of 128 samples.
    sequence = replace(PRESET.interferer, num_ramps=64, start_frequency_hz=77.0112e9)
    other = Interferer(sequence=sequence, channel=interference_paths(rng))
    scene = AntennaScene(
        scene=Scene(
            objects=channel,
            interferers=(other,) if interfered else (),
            snr_db=SNR_DB,
            sir_db=SIR_DB,
        ),
        antennas=UniformLinearArray(num_antennas=RECEIVERS),
        object_angles_deg=angles_deg,
        interferer_angles_deg=rng.uniform(-50.0, 50.0, int(interfered)),
    )
    divided = divided_scene(scene, RADAR, WAVEFORM)
    rng = np.random.default_rng([seed, 2])
    return simulate_antennas(RADAR, divided, anti_aliasing_filter=FILTER, rng=rng), angles_deg


def errors_over_bound(seed, *, interfered):
    """(L, 3) errors of beat, Doppler and angle over their bounds, missed, false, and the gTNR."""
    made, angles_deg = frame(seed, interfered=interfered)
    model = SignalModel.of_radar(RADAR, FILTER, RECEIVERS)
    state = run(FactorisedSeparator(model=model), model.check(made.received)).state
    joined, truth = join_lines(made.received, state, RADAR, WAVEFORM), made.truth
    size = WAVEFORM.num_transmitters * RECEIVERS
    found = object_angles(joined.amplitudes, np.full(len(joined.beats), joined.variance), 0.5)
    # Every weight of the virtual array tells the frequencies of its object.
    snr = np.abs(truth.amplitudes[:OBJECTS, 0]) ** 2 * truth.noise_precision
    stds = [np.sqrt(6.0 / (size * snr * (n**2 - 1.0))) / (2.0 * np.pi) for n in RADAR.shape[::-1]]
    angle_std = angle_bound_deg(snr, angles_deg, size, 0.5)
    rows, used = [], set()
    for index in range(OBJECTS):
        moves = np.stack(
            [
                wrap_frequency(joined.beats - truth.beats[index]),
                wrap_frequency(joined.dopplers - truth.dopplers[index]),
            ]
        )
        cells = np.abs(moves).T * RADAR.shape[::-1]
        near = int(np.argmin(cells.max(axis=1)))
        if cells[near].max() < 1.0:
            used.add(near)
            angle = found.angles_deg[near] - angles_deg[index]
            errors = moves[0][near] / stds[0][index], moves[1][near] / stds[1][index]
            rows.append((*errors, angle / angle_std[index]))
    cleaned = state.cleaned(model.check(made.received)).reshape(made.received.shape)
    clean = made.received - truth.interference_signal
    targets = target_cells(truth.beats, truth.dopplers, RADAR.shape)
    tnr = gtnr(cleaned[0], targets) - gtnr(clean[0], targets)
    return np.array(rows).reshape(-1, 3), OBJECTS - len(rows), len(joined.beats) - len(used), tnr


def root_mean_square(values):
    """Along the last axis."""
    return np.sqrt(np.mean(np.square(values), axis=-1))


def main(count):
    """Print the figures."""
    for interfered in (True, False):
        frames = [errors_over_bound(seed, interfered=interfered) for seed in range(count)]
        errors = np.concatenate([each[0] for each in frames])
        words = []
        for name, values in zip(("range", "velocity", "angle"), errors.T, strict=True):
            interval = bootstrap_interval(values, root_mean_square)
            words.append(
                f"{name} {root_mean_square(values):.2f} [{interval.low:.2f}, {interval.high:.2f}]"
            )
        sys.stdout.write(
            f"{'one interferer' if interfered else 'none'}: {', '.join(words)}; missed "
            f"{sum(each[1] for each in frames)}, false {sum(each[2] for each in frames)} of "
            f"{count * OBJECTS}; gTNR {np.mean([each[3] for each in frames]):+.4f}\n"
        )
        sys.stdout.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]))
