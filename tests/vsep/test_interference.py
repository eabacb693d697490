"""Algorithm 2: dense truth for the candidates, and what starts, stays, restarts and goes."""

import numpy as np
import pytest

from vsep.inference.bursts.search import BurstSearch
from vsep.inference.bursts.workspace import InterferenceWorkspace
from vsep.inference.core.progress import EventKind
from vsep.inference.core.schedule import PAPER, ROBUST
from vsep.signal.filters import RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.units import from_db

RATE, NUM_SAMPLES, SLOPE = 5.1e6, 128, -0.011065
MODEL = SignalModel(
    num_ramps=2,
    num_samples=NUM_SAMPLES,
    sample_rate_hz=RATE,
    anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25),
)
NOISE_PRECISION = 100.0


def frame(seed=0, centre=64.0, delay_bins=(0.0, 3.4), weights=(30.0, 12.0j)):
    """Noise in both ramps; the second one also holds a burst through a two-path channel."""
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(MODEL.shape) + 1j * rng.standard_normal(MODEL.shape)
    received = noise / np.sqrt(2 * NOISE_PRECISION)
    template = MODEL.template(np.array([-SLOPE * centre]), np.array([SLOPE]))[0]
    turns = np.outer(delay_bins, np.arange(NUM_SAMPLES)) / MODEL.num_grid_bins
    channel = np.array(weights) @ np.exp(-2j * np.pi * turns) / np.sqrt(NUM_SAMPLES)
    received[1] += template * channel
    return received, template * channel


def workspace(schedule=ROBUST, bursts=()):
    threshold = float(from_db(schedule.interference_threshold_db))
    return InterferenceWorkspace(MODEL, schedule, threshold, bursts)


def search(work, received, weakest_share=0.0):
    BurstSearch(work, received, NOISE_PRECISION, weakest_share=weakest_share).run()


def searched(**burst):
    """A frame, the burst in it, and a workspace after one search for bursts."""
    received, burst_signal = frame(**burst)
    work = workspace()
    search(work, received)
    return received, burst_signal, work


def kinds(work):
    return [event.kind for event in work.events]


def test_burst_is_started_in_its_ramp_only():
    _, _, work = searched()
    assert list(work.ramps) == [1]
    assert kinds(work) == [EventKind.CHIRP_STARTED]
    assert work.events[0].ramp == 1


def test_iterated_updates_cancel_the_burst_to_the_noise():
    received, burst, work = searched()
    for _ in range(8):
        work.update(received, NOISE_PRECISION)
    error = np.sum(np.abs(work.signal[1] - burst) ** 2) * NOISE_PRECISION
    # Every active weight and the two chirp parameters cost about one unit of noise energy each;
    # paths off the grid leave what lies below T_beta: 4 units a component.
    active = len(work.ramps[1].bins)
    assert error < 5 * (active + 2)
    assert np.sum(np.abs(burst) ** 2) * NOISE_PRECISION > 1e4
    assert not np.any(work.signal[0])


def test_added_component_is_the_best_passive_one_of_the_dense_formulas():
    received, _, work = searched()
    ramp = work.ramps[1]
    template = ramp.templates[0]
    turns = np.outer(np.arange(NUM_SAMPLES), np.arange(MODEL.num_grid_bins))
    atoms = template[:, None] * np.exp(-2j * np.pi * turns / MODEL.num_grid_bins)
    atoms /= np.sqrt(NUM_SAMPLES)
    active = atoms[:, ramp.bins]
    precision = NOISE_PRECISION * active.conj().T @ active + np.diag(ramp.precisions)
    covariance = np.linalg.inv(precision)
    ratios = []
    for atom in atoms.T:  # (23) and (24), one candidate at a time
        correlated = atom.conj() @ active @ covariance @ active.conj().T
        inverse_rho = NOISE_PRECISION * np.vdot(atom, atom).real
        inverse_rho -= NOISE_PRECISION**2 * (correlated @ atom).real
        omega = NOISE_PRECISION * np.vdot(atom, received[1])
        omega = (omega - NOISE_PRECISION**2 * correlated @ received[1]) / inverse_rho
        ratios.append(abs(omega) ** 2 * inverse_rho)
    ratios = np.array(ratios)
    ratios[ramp.bins] = 0.0
    work.refine_bursts = lambda *_, **__: None  # keep theta where the dense formulas were evaluated
    work.update(received, NOISE_PRECISION)
    first = next(event for event in work.events if event.kind is EventKind.CHANNEL_ADDED)
    assert first.bin == np.argmax(ratios)
    assert first.snr_db == pytest.approx(10 * np.log10(ratios.max()), abs=1e-6)


def test_a_modelled_burst_that_is_not_in_the_data_is_dropped():
    received, _, work = searched()
    work.update(received, NOISE_PRECISION)
    clean = workspace(bursts=work.frozen_bursts())
    empty, _ = frame(weights=(0.0, 0.0))
    search(clean, empty)
    assert kinds(clean) == [EventKind.CHIRP_DROPPED]
    assert clean.ramps == {}


def test_a_burst_modelled_in_the_wrong_place_is_restarted():
    received, _, work = searched(centre=40.0)
    work.update(received, NOISE_PRECISION)
    moved = workspace(bursts=work.frozen_bursts())
    elsewhere, _ = frame(centre=90.0)
    search(moved, elsewhere)
    assert kinds(moved) == [EventKind.CHIRP_RESTARTED]
    ramp = moved.ramps[1]
    assert -ramp.chirps.start_frequency[0] / ramp.chirps.slope[0] == pytest.approx(90.0, abs=2.0)


def test_a_well_modelled_burst_is_left_alone_by_the_search():
    received, _, work = searched()
    for _ in range(4):
        work.update(received, NOISE_PRECISION)
    again = workspace(bursts=work.frozen_bursts())
    search(again, received)
    assert kinds(again) == []


def test_two_crossing_bursts_in_a_ramp_are_both_cancelled_to_the_noise():
    received, first = frame(centre=55.0)
    other = MODEL.template(np.array([-0.0123 * 75.0]), np.array([0.0123]))[0]
    received[1] += 2.0 * other
    work = workspace()
    for _ in range(3):
        search(work, received, weakest_share=0.01)
        for _ in range(4):
            work.update(received, NOISE_PRECISION)
    ramp = work.ramps[1]
    assert len(ramp.chirps) == 2
    error = np.sum(np.abs(work.signal[1] - first - 2.0 * other) ** 2) * NOISE_PRECISION
    # As above, with two more chirp parameters.
    assert error < 5 * (len(ramp.bins) + 4)
    by_burst = [np.sum(np.abs(each) ** 2) for each in ramp.signals]
    energies = [np.sum(np.abs(first) ** 2), np.sum(np.abs(2.0 * other) ** 2)]
    # Where they cross they trade a few percent.
    np.testing.assert_allclose(sorted(by_burst), sorted(energies), rtol=0.1)


def test_what_the_fit_has_not_reached_yet_starts_no_further_burst():
    received, _, work = searched()
    # One component of the two-path channel: the rest is 8 dB below, and chirp-shaped.
    search(work, received, weakest_share=0.5)
    assert len(work.ramps[1].chirps) == 1
    search(work, received, weakest_share=0.0)
    assert len(work.ramps[1].chirps) == 2


def test_paper_schedule_keeps_a_template_in_every_ramp_and_adds_one_component():
    received, _ = frame()
    work = workspace(PAPER)
    search(work, received)
    assert sorted(work.ramps) == [0, 1]
    work.update(received, NOISE_PRECISION)
    added = [event for event in work.events if event.kind is EventKind.CHANNEL_ADDED]
    assert len([event for event in added if event.ramp == 1]) == 1


def test_margin_lets_a_component_fall_below_the_adding_threshold():
    work = workspace()
    assert work.prune_threshold == pytest.approx(work.threshold / from_db(ROBUST.prune_margin_db))
    paper = workspace(PAPER)
    assert paper.prune_threshold == paper.threshold
