from vsep_app.jobs.tasks import compose
from vsep_app.model.alternatives import alternatives

from tests.app.conftest import FinishedRun


def test_every_figure_is_said_in_words(many_ramps: FinishedRun, one_ramp: FinishedRun) -> None:
    first, last = (
        alternatives(compose(many_ramps.snapshot(number), 2, "level")) for number in (0, None)
    )
    assert "cross it in ramps 0, 2, 4, 6. Bursts are found in no ramp." in first["Chirps"]
    assert "Bursts are found in ramps 0, 2, 4, 6." in last["Chirps"]
    assert "nothing is cleaned" in first["Fast time"]
    assert "cleaned, median" in last["Fast time"]
    assert "No object estimated." in first["Delay spectrum"]
    assert first["Range-Doppler maps"].count("m/s") == 10
    assert "10 of 10 found, 0 false" in last["Range-Doppler maps"]
    single = alternatives(compose(one_ramp.snapshot(), 0, "level"))
    assert "Objects at 12.0 m." in single["Delay spectrum"]
    assert "Range-Doppler maps" not in single
