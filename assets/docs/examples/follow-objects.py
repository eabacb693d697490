"""Follow objects from frame to frame.

A drive past cars with radars of their own: every frame is separated from what the last one
predicts, and every object keeps its name.
"""

import vsep
from vsep.presets.street import street_frames
from vsep.presets.street_traffic import RADAR
from vsep.tracking.sources import frame_of_street

streets = list(street_frames(seed=1, num_frames=30))
results = list(vsep.track(frame_of_street(street) for street in streets))

starts = [result.start for result in results]
print({start: starts.count(start) for start in sorted(set(starts))})

# The truth of the simulation says where the cyclist is; one track follows it all the way.
names = []
for street, result in zip(streets[3:], results[3:], strict=True):
    truth = street.observation.truth
    range_m = RADAR.range_from_beat(truth.beats)[street.names.index("cyclist 1")]
    nearest = min(result.confirmed_tracks, key=lambda track: abs(track.range_m - range_m))
    assert abs(nearest.range_m - range_m) < 0.1
    names.append(nearest.track_id)
print(f"the cyclist is track {names[0]} in {len(names)} frames")
assert len(set(names)) == 1
assert starts.count("cold") == 1
