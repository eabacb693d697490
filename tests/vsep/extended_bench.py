"""Scenes of extended objects: a car of equal lines, alone or among points."""

from dataclasses import replace

import numpy as np

from vsep.grouping.groups import find_groups
from vsep.inference.core.run import run
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.presets.cars import with_car
from vsep.presets.extended_car import PRESET, scattered_points
from vsep.signal.filters import NoFilter
from vsep.signal.scene import Channel, Scene
from vsep.signal.simulate import simulate
from vsep.signal.template import SignalModel
from vsep.units import from_db, to_db

RADAR = replace(PRESET.radar, range_migration=False)
NUM_LINES, EXTENT_M = 6, 2.0
POINTS_DB = (15.0, 45.0)
NOTHING = Channel(
    delays_s=np.zeros(0), dopplers_hz=np.zeros(0), weights=np.zeros(0, dtype=np.complex128)
)


def points(rng):
    """Twenty points, weights in deviations of the noise."""
    drawn = scattered_points(rng)
    levels = np.sqrt(from_db(rng.uniform(*POINTS_DB, drawn.num_paths)))
    return replace(drawn, weights=levels * drawn.weights / abs(drawn.weights))


def car_scene(seed, line_db, *, others=True):
    """Frame, truth and estimate of a car of six lines over two metres."""
    rng = np.random.default_rng(seed)
    objects = points(rng) if others else NOTHING
    objects = with_car(rng, RADAR, objects, np.full(NUM_LINES, np.sqrt(from_db(line_db))), EXTENT_M)
    # As if the lines were orthogonal: within a tenth of a dB.
    snr_db = float(to_db(np.sum(abs(objects.weights) ** 2)))
    scene = Scene(objects=objects, snr_db=snr_db)
    made = simulate(RADAR, scene, anti_aliasing_filter=NoFilter(), rng=rng)
    model = SignalModel.of_radar(RADAR, NoFilter())
    return made.received, made.truth, run(ObjectOnlySeparator(model=model), made.received).state


def of_the_car(truth, ranges_m, velocities_mps):
    """Which places are of the car, to half a metre around it and two cells of velocity."""
    car = truth.groups == 0
    ranges = RADAR.range_from_beat(truth.beats[car])
    speed = RADAR.velocity_from_doppler(truth.dopplers[car]).mean()
    inside = (ranges_m > ranges.min() - 0.5) & (ranges_m < ranges.max() + 0.5)
    return inside & (abs(velocities_mps - speed) < 0.5)


def found_in(seed, line_db, *, others=True):
    """Points of the car that are found, its groups, other groups, and other points in any."""
    received, truth, state = car_scene(seed, line_db, others=others)
    ranges = RADAR.range_from_beat(state.objects.beats)
    speeds = RADAR.velocity_from_doppler(state.objects.dopplers)
    own = of_the_car(truth, ranges, speeds)
    groups = find_groups(received, state, RADAR)
    right = [bool(of_the_car(truth, each.range_m, each.velocity_mps)) for each in groups]
    members = [int(index) for each in groups for index in each.members]
    return {
        "points": int(own.sum()),
        "groups": sum(right),
        "others": len(right) - sum(right),
        "swallowed": int(np.sum(~own[members])),
        "left out": int(own.sum() - own[members].sum()),
    }
