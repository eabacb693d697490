"""Extended objects in a sequence: one group, which keeps its track."""

import numpy as np

from vsep.files.frame import Frame
from vsep.presets.scenes import simulate_preset
from vsep.tracking.lines import tracked_line
from vsep.tracking.sequence import track


def frames(count):
    for number in range(count):
        scenario, observation = simulate_preset(
            "extended-car",
            snr_db=45.0,
            sir_db=0.0,
            seed=7,
            interference=False,
            frame_number=number,
            num_objects=3,
        )
        yield Frame(
            received=observation.received,
            radar=scenario.radar,
            anti_aliasing_filter=scenario.anti_aliasing_filter,
            truth=observation.truth,
            name=str(number),
        )


def test_a_car_is_one_group_with_the_track_of_its_oldest_line():
    results = list(track(frames(2)))
    groups = [result.groups for result in results]
    assert [len(each) for each in groups] == [1, 1]
    numbers = [result.tracks_of(group) for result, (group,) in zip(results, groups, strict=True)]
    assert len({each[0] for each in numbers}) == 1
    truth = results[0].frame.truth
    of_car = truth.groups == 0
    true_m = results[0].frame.radar.range_from_beat(truth.beats[of_car])
    assert abs(groups[0][0].extent_m - np.ptp(true_m)) < 0.2
    (entry,) = tracked_line(results[1])["groups"]
    assert entry["track"] == numbers[1][0]
    assert entry["tracks"] == list(numbers[1])
