"""What is known from the last search is true of the next one, and spares only what it may."""

import numpy as np
import pytest

from vsep.inference.bursts import search as burst_search
from vsep.inference.bursts.chirp_search import find_single_chirps
from vsep.inference.core.run import iterate, run
from vsep.inference.core.search_cache import empty_search_cache
from vsep.inference.core.state import SearchCache
from vsep.inference.factorised import FactorisedSeparator
from vsep.presets.scenes import simulate_preset
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel

MODEL = SignalModel(
    num_ramps=6,
    num_samples=128,
    sample_rate_hz=5.1e6,
    anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=1e6, rolloff=0.25),
)


def noise(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


@pytest.mark.parametrize("antennas", [(), (3,)])
@pytest.mark.parametrize("change", [0.0, 0.1, 1.0])
def test_no_chirp_of_a_changed_rest_exceeds_its_limit(antennas, change):
    rng = np.random.default_rng(11)
    before = noise(rng, *antennas, *MODEL.shape)
    found = find_single_chirps(before, MODEL)
    seen = empty_search_cache(before).searched(np.arange(6), before, found.limit)
    after = before + change * noise(rng, *antennas, *MODEL.shape)
    # Single precision decides among the places of the grid.
    assert np.all(find_single_chirps(after, MODEL).score <= seen.limits_of(after) * (1.0 + 1e-5))


def test_a_coarse_place_that_is_not_followed_up_stands_for_all_around_it():
    rows = noise(np.random.default_rng(12), 200, 128)
    every, useful = find_single_chirps(rows, MODEL), find_single_chirps(rows, MODEL, least_score=40)
    assert np.any(useful.score < every.score)
    assert np.all(every.score <= useful.limit * (1.0 + 1e-5))


def test_where_nobody_looked_nothing_is_known():
    residuals = np.zeros((6, 128), dtype=complex)
    seen = empty_search_cache(residuals).searched(np.array([2]), residuals, np.array([4.0]))
    assert seen.limits_of(residuals).tolist() == [np.inf, np.inf, 4.0, np.inf, np.inf, np.inf]


@pytest.mark.parametrize(
    ("preset", "snr_db", "sir_db"), [("simulation-1", 30.0, -20.0), ("simulation-2-b", 60.0, 0.0)]
)
def test_a_run_that_searches_everything_anew_ends_the_same(monkeypatch, preset, snr_db, sir_db):
    scenario, observation = simulate_preset(preset, snr_db=snr_db, sir_db=sir_db, seed=21)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    separator, ramps = FactorisedSeparator(model=model), []
    find = burst_search.find_single_chirps

    def counted(rows, *args, **options):
        ramps.append(len(rows))
        return find(rows, *args, **options)

    monkeypatch.setattr(burst_search, "find_single_chirps", counted)
    remembered, spared = run(separator, observation.received), sum(ramps)
    ramps.clear()
    monkeypatch.setattr(SearchCache, "limits_of", lambda self, _: np.full(len(self.limits), np.inf))
    anew = run(separator, observation.received)
    assert spared < sum(ramps)
    assert anew.iterations == remembered.iterations
    assert np.array_equal(anew.objects.beats, remembered.objects.beats)
    assert np.array_equal(anew.state.interference_signal, remembered.state.interference_signal)


def test_a_state_carries_what_its_search_has_seen():
    scenario, observation = simulate_preset("simulation-1", snr_db=30.0, sir_db=-20.0, seed=3)
    model = SignalModel.of_radar(scenario.radar, scenario.anti_aliasing_filter)
    steps = list(iterate(FactorisedSeparator(model=model), observation.received))
    assert np.isfinite(steps[0].state.search_cache.limits).all()
    assert not steps[0].state.search_cache.residuals.flags.writeable
    assert steps[1].state.search_cache is steps[0].state.search_cache  # no search in between
