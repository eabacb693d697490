"""Activation ratios of the splines against the dense marginal model."""

import numpy as np
import pytest

from vsep.kernels.channel import grid_atoms
from vsep.kernels.complex_parts import ComplexParts, split_row
from vsep.kernels.fresnel import SMOOTH
from vsep.kernels.ramps import FlatRamps, all_posteriors, all_signals
from vsep.kernels.spline_ratios import SplineGrid, add_spline_columns, first_ratios
from vsep.signal.modified_response import bspline_responses

NUM_SAMPLES, NOISE_PRECISION, UNSEEN = 64, 50.0, 1e-9
KNOTS = np.arange(-0.5, 0.55, 0.1)
GRID = SplineGrid(KNOTS, SMOOTH)
STARTS, SLOPES = np.array([-0.3, 0.5, 0.2]), np.array([0.013, -0.02, 0.011])
SAMPLES = np.arange(NUM_SAMPLES)


def random_complex(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def chirped_splines(burst):
    """(N, S) columns of a burst with a channel of one."""
    start, slope = STARTS[burst], SLOPES[burst]
    chirp = np.exp(2j * np.pi * (start + 0.5 * slope * SAMPLES) * SAMPLES)
    return chirp[:, None] * bspline_responses(start + slope * SAMPLES, slope, KNOTS)


@pytest.mark.parametrize("burst", range(3))
def test_columns_are_added_to_those_of_the_ramp(burst):
    rng = np.random.default_rng(1)
    line, before = random_complex(rng, NUM_SAMPLES), rng.standard_normal((2, 7, NUM_SAMPLES))
    columns = ComplexParts(*before.copy())
    add_spline_columns(STARTS[burst], SLOPES[burst], split_row(line), GRID, columns)
    added = columns - before
    expected = (chirped_splines(burst) * line[:, None]).T
    # Rounding is amplified by the cubics of far knots, 1e4 times here.
    np.testing.assert_allclose(added[0] + 1j * added[1], expected, rtol=0, atol=1e-10)


def test_ratios_are_those_of_the_dense_marginal_model():
    rng = np.random.default_rng(2)
    owners, bins = np.array([0, 0, 1, 2, 2]), np.array([0, 3, 125, 0, 7])  # the second has two
    ramps = FlatRamps(
        templates=random_complex(rng, 3, NUM_SAMPLES),
        first_burst=np.array([0, 1, 3]),
        owners=owners,
        bins=bins,
        precisions=rng.uniform(0.5, 2.0, 5),
        first_column=np.array([0, 2, 5]),
        twiddle=np.exp(-2j * np.pi * np.arange(128) / 128) / np.sqrt(NUM_SAMPLES),
    )
    residual = random_complex(rng, 2, NUM_SAMPLES)
    posterior = all_posteriors(ramps, residual, NOISE_PRECISION)
    signals = all_signals(ramps, posterior.amplitudes)
    rest = residual - np.array([signals[0], signals[1] + signals[2]])
    weights = posterior.covariances, posterior.amplitudes
    found = first_ratios(ramps, (STARTS, SLOPES), weights, rest, NOISE_PRECISION, GRID, UNSEEN)
    atoms = grid_atoms(NUM_SAMPLES, bins, ramps.twiddle)
    projections, energies = 0.0, 0.0
    for r, bursts in enumerate(([0], [1, 2])):
        own = np.arange(ramps.first_column[r], ramps.first_column[r + 1])
        columns = sum(
            chirped_splines(b) * (posterior.amplitudes[k] * atoms[k])[:, None]
            for b in bursts
            for k in own[owners[own] == b]
        )
        channels = (ramps.templates[owners[own]] * atoms[own]).T
        prior = channels @ np.diag(1.0 / ramps.precisions[own]) @ channels.conj().T
        spread = np.eye(NUM_SAMPLES) + NOISE_PRECISION * prior
        weighted = np.linalg.solve(spread, columns).conj().T
        projections += weighted @ residual[r]
        energies += np.sum(weighted * columns.T, axis=1).real
    expected = NOISE_PRECISION * np.abs(projections) ** 2 / energies
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_channels_explain_to_rounding_is_no_spline():
    """A channel column that is a spline's column itself leaves nothing of it."""
    columns = ComplexParts(np.zeros((7, NUM_SAMPLES)), np.zeros((7, NUM_SAMPLES)))
    line = split_row(np.ones(NUM_SAMPLES, dtype=complex))
    add_spline_columns(STARTS[0], SLOPES[0], line, GRID, columns)
    ramps = FlatRamps(
        templates=(columns.real[3] + 1j * columns.imag[3])[None],
        first_burst=np.array([0, 1]),
        owners=np.array([0]),
        bins=np.array([0]),
        precisions=np.array([1e-12]),
        first_column=np.array([0, 1]),
        twiddle=np.ones(128, dtype=complex),
    )
    residual = random_complex(np.random.default_rng(3), 1, NUM_SAMPLES)
    posterior = all_posteriors(ramps, residual, NOISE_PRECISION)
    rest = residual - all_signals(ramps, posterior.amplitudes)
    courses, weights = (STARTS[:1], SLOPES[:1]), (posterior.covariances, posterior.amplitudes)
    ratios = first_ratios(ramps, courses, weights, rest, NOISE_PRECISION, GRID, UNSEEN)
    assert ratios[3] == 0.0
    assert np.all(np.delete(ratios, 3) > 0.0)
