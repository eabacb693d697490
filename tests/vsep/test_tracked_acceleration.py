"""Objects that accelerate in a sequence: exact kinematics as the truth."""

import json

import numpy as np
import pytest
from vsep_app.cli.main import main

import vsep
from vsep.errors import InputError
from vsep.files.frame import Frame, write_frame
from vsep.presets.scenes import preset_radar
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.radar import SPEED_OF_LIGHT_MPS, InterfererSequence
from vsep.signal.scene import Channel, Interferer, Scene
from vsep.signal.simulate import simulate
from vsep.tracking.lines import tracked_line
from vsep.tracking.sequence import SequenceSeparator

RADAR = preset_radar("braking")
FILTER = RaisedCosineFilter(cutoff_hz=RADAR.sample_rate_hz / 4.0, rolloff=0.25)
CYCLE_S = 0.05
RANGES_M = np.array([12.0, 22.0, 30.0, 8.0, 40.0])
VELOCITIES_MPS = np.array([-6.0, 3.0, -2.0, 0.5, 5.0])
ACCELERATIONS_MPS2 = np.array([-8.0, 9.0, 0.0, 0.0, 6.0])
LEVELS = np.array([1.0, 0.6, 0.5, 0.3, 0.7])
METRES = float(RADAR.range_from_beat(np.ones(1) / 4.0)[0]) * 4.0  # in one cycle a sample
SPEED_MPS = float(RADAR.velocity_from_doppler(1.0))
BEGUN = 2  # the frame before which the last object keeps its velocity


def kinematics(number):
    """Distances, velocities and accelerations in mid-frame."""
    time_s = np.full(5, number * CYCLE_S)
    time_s[-1] = max(number - BEGUN, 0) * CYCLE_S
    accelerations = ACCELERATIONS_MPS2 * (time_s > 0.0) if number else ACCELERATIONS_MPS2.copy()
    accelerations[-1] *= number > BEGUN
    ranges_m = RANGES_M + VELOCITIES_MPS * number * CYCLE_S + 0.5 * ACCELERATIONS_MPS2 * time_s**2
    return ranges_m, VELOCITIES_MPS + ACCELERATIONS_MPS2 * time_s, accelerations


def interferer(rng):
    return Interferer(
        sequence=InterfererSequence(
            start_frequency_hz=RADAR.start_frequency_hz + 20e6,
            slope_hz_per_s=0.7 * RADAR.slope_hz_per_s,
            ramp_duration_s=RADAR.ramp_period_s,
            ramp_period_s=1.0007 * RADAR.ramp_period_s,
            num_ramps=RADAR.num_ramps,
            time_offset_s=rng.uniform(-5e-6, 5e-6),
        ),
        channel=Channel(
            delays_s=np.array([0.0, 1e-8]), dopplers_hz=np.zeros(2), weights=np.array([1.0, 0.3j])
        ),
    )


def frames(count, *, interfered):
    rng = np.random.default_rng(1)
    per_mps = 2.0 * RADAR.start_frequency_hz / SPEED_OF_LIGHT_MPS
    for number in range(count):
        ranges_m, velocities, accelerations = kinematics(number)
        objects = Channel(
            delays_s=2.0 * ranges_m / SPEED_OF_LIGHT_MPS,
            dopplers_hz=per_mps * velocities,
            weights=LEVELS * np.exp(2j * np.pi * rng.uniform(size=5)),
            doppler_rates_hz_per_s=per_mps * accelerations,
        )
        scene = Scene(
            objects=objects,
            interferers=(interferer(rng),) if interfered else (),
            snr_db=55.0,
            sir_db=-15.0,
        )
        made = simulate(RADAR, scene, anti_aliasing_filter=FILTER, rng=rng)
        yield Frame(
            received=made.received,
            radar=RADAR,
            anti_aliasing_filter=FILTER,
            name=f"frame-{number}",
        )


@pytest.mark.parametrize("interfered", [False, True])
def test_one_object_and_one_track_each_at_its_place_velocity_and_acceleration(interfered):
    played = vsep.track(frames(6, interfered=interfered), cycle_s=CYCLE_S, acceleration="modelled")
    ids, errors, false = [], [], 0
    for number, result in enumerate(played):
        found = tracked_line(result)["objects"]
        assert result.start == "cold" if number == 0 else result.start in ("warm", "clean")
        places = []
        for metres, speed, acceleration in zip(*kinematics(number), strict=True):
            apart = [abs(each["range_m"] - metres) for each in found]
            each = found[int(np.argmin(apart))]
            places.append(int(np.argmin(apart)))
            errors += [
                (each["range_m"] - metres) / (each["beat_std"] * METRES),
                (each["velocity_mps"] - speed) / (each["doppler_std"] * SPEED_MPS),
            ]
            if acceleration:
                off = each["acceleration_mps2"] - acceleration
                errors.append(off / each["acceleration_std_mps2"])
        false += len(found) - 5
        ids.append(result.solution.objects.component_ids[places].tolist())
        if number >= 2:
            assert [track.track_id for track in result.confirmed_tracks] == [1, 2, 3, 4, 5]
    assert false <= 1  # of noise: one in twenty frames is asked for
    assert all(each[:4] == ids[0][:4] for each in ids)
    # Some 75 standard normal errors: their mean square lies within [0.63, 1.47] in 99 %.
    assert 0.63 < np.mean(np.square(errors)) < 1.47


def test_the_command_has_it_and_refuses_what_it_is_not(tmp_path):
    paths = []
    for frame in frames(2, interfered=False):
        paths.append(str(tmp_path / f"{frame.name}.npz"))
        write_frame(paths[-1], frame)
    out = tmp_path / "lines.jsonl"
    assert main(["stream", *paths, "--acceleration", "modelled", "--out", str(out)]) == 0
    lines = [json.loads(line) for line in out.read_text().splitlines()]
    assert [len(line["objects"]) for line in lines] == [5, 5]
    assert max(each["acceleration_mps2"] for each in lines[1]["objects"]) > 5.0
    with pytest.raises(InputError, match="acceleration is 'known'"):
        SequenceSeparator(acceleration="known")
