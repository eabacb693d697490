"""Approximate message passing: its denoisers by quadrature, its results by an oracle."""

import numpy as np
import pytest

from tests.vsep.sparse_bench import sparse_problem
from vsep.mitigation.sparse import message_passing
from vsep.mitigation.sparse.message_passing import Amp, Gamp
from vsep.mitigation.sparse.operators import MaskedFft
from vsep.mitigation.sparse.support import least_squares
from vsep.mitigation.sparse.thresholding import soft_threshold


def advanced(solver, operator, measured, iterations):
    state = solver.init(operator, measured)
    for _ in range(iterations):
        state = solver.step(operator, measured, state)
    return state


def test_the_memory_term_is_the_mean_derivative_of_the_threshold():
    rng = np.random.default_rng(0)
    values = rng.standard_normal(200) + 1j * rng.standard_normal(200)
    step = 1e-6
    # Half the divergence over real and imaginary part, by central differences.
    slopes = [
        ((soft_threshold(values + move, 0.8) - soft_threshold(values - move, 0.8)) / (2.0 * move))
        for move in (step, 1j * step)
    ]
    expected = np.mean([slope.real for slope in slopes])
    assert message_passing._mean_slope(values, 0.8) == pytest.approx(expected, rel=1e-7)


def test_the_denoiser_is_the_posterior_of_its_prior():
    operator = MaskedFft(np.zeros((4, 4), dtype=bool), np.complex128)
    state = Gamp(initial_occupied=0.1).init(operator, np.full((4, 4), 0.5 + 0j))
    variance = 0.3
    axis = np.linspace(-12.0, 12.0, 1201)
    cell = axis[:, None] + 1j * axis
    area = (axis[1] - axis[0]) ** 2
    for pseudo in (0.3 + 0.2j, 1.5 - 1.0j, 3.0j):
        likelihood = np.exp(-(np.abs(pseudo - cell) ** 2) / variance) / (np.pi * variance)
        slab = np.exp(-(np.abs(cell) ** 2) / state.cell_power) / (np.pi * state.cell_power)
        occupied = 0.1 * likelihood * slab * area
        spike = 0.9 * np.exp(-(np.abs(pseudo) ** 2) / variance) / (np.pi * variance)
        evidence = occupied.sum() + spike
        mean, probability, spread = message_passing._bernoulli_gaussian(
            np.array([pseudo]), variance, state
        )
        # The trapezoidal rule is exact here up to what lies beyond its ends.
        assert probability[0] == pytest.approx(occupied.sum() / evidence, rel=1e-9)
        assert mean[0] == pytest.approx(np.sum(occupied * cell) / evidence, rel=1e-9)
        second = np.sum(occupied * np.abs(cell) ** 2) / evidence
        assert spread[0] == pytest.approx(second - abs(mean[0]) ** 2, rel=1e-9)


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_amp_recovers_what_no_noise_hides(share):
    frame, mask, spectrum = sparse_problem(1, shape=(32, 64), share=share, noise=0.0, occupied=20)
    operator = MaskedFft(mask, np.complex128)
    found = advanced(Amp(), operator, operator.measured(frame), 80).spectrum
    # The threshold falls with the residual, geometrically; after 80 iterations rounding is left.
    np.testing.assert_allclose(found, spectrum, atol=1e-12)


def test_gamp_comes_close_to_the_one_who_knows_the_support():
    noise = 0.02
    frame, mask, spectrum = sparse_problem(2, shape=(32, 64), noise=noise, occupied=40)
    operator = MaskedFft(mask, np.complex128)
    measured = operator.measured(frame)
    state = advanced(Gamp(), operator, measured, 80)
    oracle = least_squares(operator, measured, spectrum != 0.0)
    errors = [np.linalg.norm(found - spectrum) for found in (state.spectrum, oracle)]
    # Cells of 34 dB over the noise leave no doubt where they are: within a tenth of the oracle.
    assert errors[0] < 1.1 * errors[1]
    # It learns the share of occupied cells, and the noise power to 5 / sqrt(q) = 13 %.
    assert state.occupied == pytest.approx(40 / spectrum.size, rel=0.05)
    assert state.noise_power == pytest.approx(2.0 * noise**2, rel=0.15)


def test_a_frame_of_zeros_stays_where_it_is():
    operator = MaskedFft(np.eye(4, dtype=bool), np.complex128)
    measured = np.zeros((4, 4), dtype=complex)
    for solver in (Amp(), Gamp()):
        state = advanced(solver, operator, measured, 3)
        assert not np.any(state.spectrum)
        assert state.may_stop
