"""Objects at chosen places in the scenes of the presets."""

from typing import Any

import numpy as np
import pytest

from vsep.errors import InputError
from vsep.presets.places import Place, parse_places, places_text
from vsep.presets.scenes import simulate_preset

PLACES = (Place(12.0, 1.5, 0.0), Place(20.0, -4.0, -6.0))
LEVELS: dict[str, Any] = {"snr_db": 60.0, "sir_db": -20.0, "seed": 3}


def test_objects_are_where_they_were_placed() -> None:
    scenario, observation = simulate_preset("simulation-2-b", places=PLACES, **LEVELS)
    radar, truth = scenario.radar, observation.truth
    assert truth is not None
    assert radar.range_from_beat(truth.beats) == pytest.approx([12.0, 20.0])
    assert radar.velocity_from_doppler(truth.dopplers) == pytest.approx([1.5, -4.0])
    weights = np.abs(truth.amplitudes)
    assert 20.0 * np.log10(weights[1] / weights[0]) == pytest.approx(-6.0)


def test_bursts_and_noise_are_those_of_the_seed_whatever_is_placed() -> None:
    signals = []
    for places in ((), PLACES):
        frame = simulate_preset("simulation-2-b", places=places, **LEVELS)[1]
        assert frame.truth is not None
        bursts = frame.truth.interference_signal
        noise = frame.received - frame.truth.object_signal - bursts
        signals.append([each / np.linalg.norm(each) for each in (bursts, noise)])
    np.testing.assert_allclose(signals[0], signals[1], atol=1e-9)


def test_a_text_is_read_as_it_is_written() -> None:
    assert parse_places(places_text(PLACES)) == PLACES
    assert parse_places("") == ()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("12,1", "each is a range in m, a velocity"),
        ("12,1,loud", "each is a range in m, a velocity"),
        ("12,1,nan", "level of an object"),
        ("1,1,1;" * 41, "number of objects"),
    ],
)
def test_a_text_that_is_none_is_told(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        parse_places(text)


@pytest.mark.parametrize("place", [Place(90.0, 0.0, 0.0), Place(10.0, 90.0, 0.0)])
def test_a_place_that_the_radar_would_fold_is_refused(place: Place) -> None:
    with pytest.raises(InputError, match="of an object"):
        simulate_preset("simulation-2-b", places=(place,), **LEVELS)
