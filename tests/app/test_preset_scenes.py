"""Frames of the dashboard's settings are those that version 0.1.0 made."""

import numpy as np
import pytest
from vsep_app.jobs import tasks
from vsep_app.jobs.tasks import make_scene
from vsep_app.model.settings import Settings, preset_values

CHANGES = {
    "plain": {},
    "moved": {"burst_shift": 3.7, "sir_db": -30.0},
    "steep": {"interferer_slope": 10.9, "interference_model": "convolution"},
}
BEFORE = {
    "simulation-1/plain": (-2.892587412752998 + 2.595902679278804j),
    "simulation-1/moved": (13.535075961517954 - 3.56569485068193j),
    "simulation-1/steep": (-0.5511071424657761 - 3.523214513422613j),
    "simulation-2-b/plain": (0.19783369873810064 - 0.3903448761418837j),
    "simulation-2-b/moved": (0.4718463531662495 - 1.7566122333076084j),
    "simulation-2-b/steep": (0.15053762329737286 - 0.14040652768695952j),
    "real-frame/plain": (17149.621756850887 + 1627.1611832569379j),
    "real-frame/moved": (-315073.27367052145 - 191589.72409314616j),
    "real-frame/steep": (-24473.673906977998 + 24350.291171991954j),
}


@pytest.mark.parametrize("key", BEFORE)
def test_a_frame_of_the_dashboard_is_what_it_was(key, monkeypatch):
    # The numbers are of the recorded frame with all that stands still.
    monkeypatch.setattr(tasks, "remove_static_clutter", lambda received, _: received)
    monkeypatch.setattr(tasks, "recorded_frame", tasks.recorded_frame.__wrapped__)
    name, kind = key.split("/")
    changes = CHANGES[kind]
    if key == "real-frame/steep":
        changes = {**changes, "interferer_slope": 60.3}
    frame = make_scene(Settings(**{**preset_values(name), **changes}).plan()).frame.received
    projection = complex(np.sum(frame.ravel() * np.cos(np.arange(frame.size))))
    assert abs(projection - BEFORE[key]) < 1e-9 * np.linalg.norm(frame)
