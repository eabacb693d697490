import numpy as np
import pytest

from vsep import FactorisedSeparator, ObjectOnlySeparator, SignalModel, run
from vsep.files.frame import read_frame, write_frame
from vsep.studies.catalogue import make_study
from vsep.studies.frames import trial_frame
from vsep.studies.trial import run_trial


@pytest.mark.parametrize(
    ("method", "kind"),
    [("factorised", FactorisedSeparator), ("no-interference", ObjectOnlySeparator)],
)
@pytest.mark.parametrize("point", [20, 35])
def test_a_trials_frame_file_gives_the_row_of_the_trial(tmp_path, method, kind, point):
    trial = make_study("fig-3", methods=(method,)).trial(point, 2)
    path = tmp_path / "frame.npz"
    write_frame(path, trial_frame(trial, method))
    frame = read_frame(path)
    model = SignalModel.of_radar(frame.radar, frame.assumed_filter)
    separator = kind(model=model, object_threshold_db=trial.point.object_threshold_db)
    objects = run(separator, frame.received).objects
    (row,) = run_trial(trial)
    assert objects.num_components == row["num_objects"]
    nearest = np.abs(objects.beats - frame.truth.beats[0]).min()
    # Rows keep seven digits.
    assert nearest == pytest.approx(row["errors"][0], rel=1e-6)


def test_only_the_frame_with_bursts_states_a_sir():
    trial = make_study("fig-5").trial(20, 0)
    with_bursts, without = (trial_frame(trial, m) for m in ("joint", "no-interference"))
    assert with_bursts.settings == {"preset": "simulation-2-a", "snr_db": "60.0", "sir_db": "-15.0"}
    assert "sir_db" not in without.settings
    assert not np.any(without.truth.interference_signal)
