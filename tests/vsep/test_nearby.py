"""Fit of objects next to known places: against differences, and against Algorithm 3."""

from dataclasses import replace

import numpy as np
import pytest

from vsep.inference.bursts.chirp_search import tone_powers
from vsep.inference.bursts.long_chirps import _best_long_chirp, _slope_grid
from vsep.inference.core.estimator import SETTLED_DEVIATIONS
from vsep.inference.core.run import run
from vsep.inference.deviations import state_deviations
from vsep.inference.objects.expansion import expanded
from vsep.inference.objects.nearby import LEFT_OUT_DEVIATIONS, fit_nearby
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.signal.atoms import line_factors, synthesize
from vsep.signal.filters import NoFilter, RaisedCosineFilter
from vsep.signal.template import SignalModel
from vsep.tracking.interfered_samples import raised_rows

SHAPE = 16, 64


def centred_atoms(points, shape):
    """Atoms whose phase stands still in the middle of the frame, by their definition."""
    ramps, samples = (np.arange(size) - (size - 1) / 2 for size in shape)
    cycles = points[:, 0, None, None] * samples + points[:, 1, None, None] * ramps[:, None]
    return np.exp(-2j * np.pi * cycles) / np.sqrt(shape[0] * shape[1])


@pytest.mark.parametrize(("shape", "num_antennas"), [((4, 16), 1), ((5, 17), 1), ((4, 15), 2)])
def test_an_expansion_holds_the_derivatives(shape, num_antennas):
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.5, 0.5, (3, 2))
    frame = rng.standard_normal((2, num_antennas * shape[0], shape[1]))
    frame = frame[0] + 1j * frame[1]
    around = expanded(points, frame, num_antennas)
    still = centred_atoms(points, shape)

    def products(beat, doppler):
        atoms = centred_atoms(points + np.array([beat, doppler]), shape).conj()
        ours = np.einsum("kpn,apn->ka", atoms, frame.reshape(num_antennas, *shape))
        return ours, np.einsum("ipn,kpn->ik", atoms, still)

    step = 1e-4
    grid = {(i, j): products(i * step, j * step) for i in (-1, 0, 1) for j in (-1, 0, 1)}
    for number, found in enumerate((around.products, around.grams)):
        at = {place: values[number] for place, values in grid.items()}
        expected = [
            at[0, 0],
            (at[1, 0] - at[-1, 0]) / (2 * step),
            (at[0, 1] - at[0, -1]) / (2 * step),
            (at[1, 0] - 2 * at[0, 0] + at[-1, 0]) / step**2,
            (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4 * step**2),
            (at[0, 1] - 2 * at[0, 0] + at[0, -1]) / step**2,
        ]
        for own, difference in zip(found, expected, strict=True):
            # Central differences err by the square of the phase step, (2 pi 8 step)^2 = 3e-5.
            np.testing.assert_allclose(own, difference, atol=1e-4 * np.abs(difference).max() + 1e-7)


@pytest.fixture(scope="module")
def scene():
    """Five objects in noise, two of them 1.4 resolution cells apart, as Algorithm 3 ends."""
    rng = np.random.default_rng(3)
    beats = np.array([0.1, 0.1 + 1.4 / SHAPE[1], -0.2, 0.31, 0.4])
    dopplers = np.array([0.2, 0.2, -0.3, 0.0, 0.41])
    weights = np.array([30.0, 40.0j, -25.0, 60.0, 12.0j])
    signal = synthesize(weights, line_factors(beats, SHAPE[1]), line_factors(dopplers, SHAPE[0]))
    noise = rng.standard_normal((2, *SHAPE)) / np.sqrt(2.0)
    frame = signal + noise[0] + 1j * noise[1]
    model = SignalModel(
        num_ramps=SHAPE[0],
        num_samples=SHAPE[1],
        sample_rate_hz=1e6,
        anti_aliasing_filter=NoFilter(),
    )
    separator = ObjectOnlySeparator(model=model)
    return separator, frame, run(separator, frame).state


def test_objects_that_have_moved_end_where_algorithm_3_does(scene):
    separator, frame, state = scene
    std = state_deviations(state, SHAPE)
    moved = replace(
        state.objects,
        beats=state.objects.beats + 2.0 * std.beats,
        dopplers=state.objects.dopplers - 2.0 * std.dopplers,
    )
    threshold = separator.object_threshold(None)
    fit = fit_nearby(moved, frame, 0.9 * state.noise_precision, threshold)
    found = fit.components
    # What an expansion may leave out, and where a run ends
    most = LEFT_OUT_DEVIATIONS + SETTLED_DEVIATIONS
    assert np.abs((found.beats - state.objects.beats) / std.beats).max() < most
    assert np.abs((found.dopplers - state.objects.dopplers) / std.dopplers).max() < most
    np.testing.assert_allclose(found.precisions, state.objects.precisions, rtol=2e-3)
    assert fit.noise_precision == pytest.approx(state.noise_precision, rel=1e-3)
    assert fit.events == ()


def test_an_object_that_is_not_there_goes_and_the_others_stay(scene):
    separator, frame, state = scene
    beats = state.objects.beats.copy()
    beats[2] += 10.0 / SHAPE[1]
    moved = replace(state.objects, beats=beats)
    fit = fit_nearby(
        moved, frame, state.noise_precision, separator.object_threshold(None), estimates_noise=False
    )
    gone = state.objects.component_ids[2]
    assert [event.component_id for event in fit.events] == [gone]
    assert set(fit.components.component_ids) == set(state.objects.component_ids) - {gone}


def test_a_frame_with_much_more_than_its_objects_is_told(scene):
    separator, frame, state = scene
    louder = frame.copy()
    louder[3, 10:40] += 100.0
    threshold = separator.object_threshold(None)
    assert fit_nearby(state.objects, louder, state.noise_precision, threshold) is None


def test_a_long_weak_burst_raises_its_row_and_noise_none():
    rng = np.random.default_rng(5)
    noise = rng.standard_normal((2, 200, 256)) / np.sqrt(2.0)
    rows = noise[0] + 1j * noise[1]
    assert not raised_rows(np.abs(rows) ** 2, 1.0).any()
    rows[17, 60:188] += np.exp(0.002j * np.arange(128) ** 2)
    assert np.flatnonzero(raised_rows(np.abs(rows) ** 2, 1.0)).tolist() == [17]


@pytest.mark.parametrize("seed", range(4))
def test_the_coarse_search_finds_the_long_chirp_that_all_slopes_do(seed):
    rng = np.random.default_rng(seed)
    model = SignalModel(
        num_ramps=4,
        num_samples=128,
        sample_rate_hz=1e6,
        anti_aliasing_filter=RaisedCosineFilter(cutoff_hz=2.5e5, rolloff=0.25),
    )
    samples = np.arange(128)
    chirp = np.exp(1j * np.pi * (rng.uniform(-0.003, 0.003) * samples**2 + rng.random() * samples))
    row = rng.uniform(0.4, 2.0) * chirp
    row = row + (rng.standard_normal(128) + 1j * rng.standard_normal(128)) / np.sqrt(2.0)
    count = int(2.0 * model.normalised_cutoff * 128 / 0.5)
    slopes = _slope_grid(128, count).slopes
    turned = np.exp(-1j * np.pi * slopes[:, None] * samples**2)
    power = tone_powers(turned * row)
    _, slope, score = _best_long_chirp(row, model, 0.0)
    assert score == power.max()
    assert slope == slopes[np.argmax(power.max(axis=1))]
