"""Transmitters that send in every ramp with phase steps: lines and objects."""

import json
from dataclasses import replace

import numpy as np
import pytest
from vsep_app.cli.main import main

from vsep.analysis.angles import angle_bound_deg, object_angles
from vsep.errors import InputError
from vsep.files.frame import read_frame
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import preset_radar
from vsep.signal.doppler_division import DopplerDivision, divided_scene, parse_doppler_division
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.linear_array import AntennaScene, UniformLinearArray
from vsep.signal.radar import SPEED_OF_LIGHT_MPS
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import simulate_antennas
from vsep.signal.template import SignalModel
from vsep.units import wrap_frequency
from vsep.waveforms.doppler_division import join_lines

RADAR = replace(preset_radar("braking"), num_ramps=32, num_samples=64, sample_rate_hz=2.5e6)
WAVEFORM = DopplerDivision(num_transmitters=2, num_bands=3)
RANGES_M, VELOCITIES_MPS = np.array([6.0, 13.0, 21.0]), np.array([-2.0, 3.1, 0.4])
ANGLES_DEG = np.array([-25.0, 5.0, 40.0])
LEVELS = np.array([1.0, 0.5, 0.2])
FILTER = RaisedCosineFilter(cutoff_hz=RADAR.sample_rate_hz / 4.0, rolloff=0.25)


def three(seed, *, snr_db=40.0, num_antennas=2, levels=LEVELS):
    rng = np.random.default_rng(seed)
    objects = Channel(
        delays_s=2.0 * RANGES_M / SPEED_OF_LIGHT_MPS,
        dopplers_hz=2.0 * VELOCITIES_MPS * RADAR.start_frequency_hz / SPEED_OF_LIGHT_MPS,
        weights=levels * np.exp(2j * np.pi * rng.uniform(size=3)),
    )
    scene = AntennaScene(
        scene=Scene(objects=objects, snr_db=snr_db),
        antennas=UniformLinearArray(num_antennas=num_antennas),
        object_angles_deg=ANGLES_DEG,
        interferer_angles_deg=np.zeros(0),
    )
    scene = divided_scene(scene, RADAR, WAVEFORM)
    made = simulate_antennas(RADAR, scene, anti_aliasing_filter=FILTER, rng=rng)
    model = SignalModel.of_radar(RADAR, FILTER, num_antennas)
    state = run(FactorisedSeparator(model=model), model.check(made.received)).state
    return made, state


def test_an_object_has_a_line_for_each_transmitter_with_the_weights_of_a_longer_array():
    made, _ = three(0)
    truth = made.truth
    apart = wrap_frequency(truth.dopplers[3:] - truth.dopplers[:3])
    assert apart == pytest.approx(np.full(3, 1.0 / 3.0))
    weights = np.concatenate([truth.amplitudes[:3], truth.amplitudes[3:]], axis=1)
    steering = UniformLinearArray(num_antennas=4).steering(ANGLES_DEG)
    assert weights / weights[:, :1] == pytest.approx(steering)


def test_lines_are_joined_to_objects_with_their_own_doppler_frequency_and_angle():
    errors = []
    for seed in range(4):
        made, state = three(seed)
        assert state.objects.num_components == 6
        joined = join_lines(made.received, state, RADAR, WAVEFORM)
        assert joined.lines.shape == (3, 2)
        assert joined.lines.min() >= 0
        order = np.argsort(joined.beats)
        found = object_angles(joined.amplitudes, np.full(3, joined.variance), 0.5)
        truth = made.truth
        beats, dopplers = RADAR.beat_from_delay(2.0 * RANGES_M / SPEED_OF_LIGHT_MPS), truth.dopplers
        snr = np.abs(truth.amplitudes[:3, 0]) ** 2 * truth.noise_precision
        # Both lines and antennas: eight weights of this SNR tell the frequencies of one object.
        stds = [np.sqrt(6.0 / (4.0 * snr * (n**2 - 1.0))) / (2.0 * np.pi) for n in (64, 32)]
        bounds = [*stds, angle_bound_deg(snr, ANGLES_DEG, 4, 0.5)]
        for values, true, bound in zip(
            (joined.beats, joined.dopplers, found.angles_deg),
            (beats, dopplers[:3], ANGLES_DEG),
            bounds,
            strict=True,
        ):
            errors.append((wrap_or_not(values[order] - true, bound)) / bound)
    squares = np.square(errors).reshape(4, 3, 3).sum(axis=(0, 2))
    # Twelve of each: a chi-square law of 12 degrees of freedom lies within [3.1, 28.3] in 99 %.
    assert np.all((squares > 3.0) & (squares < 28.5))


def wrap_or_not(differences, bound):
    return wrap_frequency(differences) if bound.max() < 0.1 else differences


def test_a_line_that_is_too_weak_is_looked_for_where_it_must_be():
    made, state = three(5)
    strong = int(np.argmax(state.objects.powers))
    alone = np.zeros(6, dtype=np.bool_)
    alone[strong] = True
    hidden = replace(state, objects=state.objects.chosen(alone))
    lines = np.flatnonzero(~alone)
    partner = join_lines(made.received, state, RADAR, WAVEFORM)
    joined = join_lines(
        made.received,
        replace(hidden, object_signal=state.object_signal - signal_of(state, lines)),
        RADAR,
        WAVEFORM,
    )
    assert sorted(joined.lines[0]) == [-1, 0]
    assert joined.dopplers[0] == pytest.approx(partner.dopplers[0], abs=2e-4)
    assert abs(joined.amplitudes[0]) == pytest.approx(abs(partner.amplitudes[0]), rel=0.1)


def signal_of(state, lines):
    from vsep.signal.chirped_atoms import chirped_signals

    objects = state.objects
    points = np.stack([objects.beats, objects.dopplers, np.zeros(6)], axis=1)[lines]
    made = chirped_signals(points, objects.amplitudes[lines], RADAR.shape).sum(axis=0)
    return made.reshape(state.object_signal.shape)


def test_the_commands_know_it(tmp_path, capsys):
    frame, out = tmp_path / "frame.npz", tmp_path / "lines.jsonl"
    simulate = (
        "simulate --preset simulation-2-a --antennas 2 --doppler-division 2/4 --num-objects 1"
    )
    options = "--no-interference --snr-db 50 --seed 3 --object-angles-deg 20 --out"
    assert main([*simulate.split(), *options.split(), str(frame)]) == 0
    assert read_frame(frame).settings["doppler_division"] == "2/4"
    assert main(["separate", str(frame), "--out", str(out)]) == 0
    (target,) = json.loads(out.read_text())["targets"]
    assert target["angle_deg"] == pytest.approx(20.0, abs=4.0 * target["angle_std_deg"])
    assert len(target["amplitude"]) == 4
    with pytest.raises(SystemExit):
        main(["separate", str(frame), "--out", str(out), "--doppler-division", "2/2"])
    assert "must lie between 3 and 128" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "2", "2/2", "a/b", "1/2/3"])
def test_what_is_no_division_is_refused(text):
    with pytest.raises(InputError):
        parse_doppler_division(text)
