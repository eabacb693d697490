"""Algorithm 4 on one ramp against its dense definition, one candidate at a time."""

import numpy as np
import pytest

from vsep.kernels.channel import Channel
from vsep.kernels.channel_products import fill_product_rows
from vsep.kernels.channel_selection import reestimate_precisions, with_best_bins
from vsep.kernels.posterior import inverse_factor, log_evidence, weight_posterior

NUM_SAMPLES, NUM_BINS, NOISE_PRECISION, THRESHOLD, MOST = 32, 64, 20.0, 8.0, 3
TWIDDLE = np.exp(-2j * np.pi * np.arange(NUM_BINS) / NUM_BINS) / np.sqrt(NUM_SAMPLES)


def random_complex(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


@pytest.fixture
def ramp():
    """Two crossing bursts with one column each, and a residual that holds some more."""
    rng = np.random.default_rng(4)
    templates = random_complex(rng, 2, NUM_SAMPLES)
    channel = Channel(np.array([0, 1]), np.array([5, 40]), np.array([0.3, 0.6]), TWIDDLE)
    hidden = [(0, 5), (0, 9), (1, 40), (1, 3), (0, 63), (1, 20)]
    weights = random_complex(rng, len(hidden))
    residual = sum(w * column(templates, *each) for w, each in zip(weights, hidden, strict=True))
    return templates, channel, residual + 0.1 * random_complex(rng, NUM_SAMPLES)


def column(templates, owner, channel_bin):
    turns = np.arange(NUM_SAMPLES) * channel_bin / NUM_BINS
    return templates[owner] * np.exp(-2j * np.pi * turns) / np.sqrt(NUM_SAMPLES)


def products_of(templates, residual):
    rows = np.empty((len(templates) * (len(templates) + 1), NUM_SAMPLES), dtype=complex)
    fill_product_rows(templates, residual, NUM_BINS / np.sqrt(NUM_SAMPLES), rows)
    return np.fft.ifft(rows, NUM_BINS, axis=1)


def dense_posterior(columns, residual, precisions):
    atoms = np.array(columns).T
    covariance = np.linalg.inv(
        NOISE_PRECISION * atoms.conj().T @ atoms + np.diag(np.array(precisions))
    )
    return atoms, covariance, NOISE_PRECISION * covariance @ atoms.conj().T @ residual


def dense_ratio(atom, columns, residual, precisions):
    """(23)-(24) of one candidate: omega^2 / rho and 1 / rho."""
    atoms, covariance, mean = dense_posterior(columns, residual, precisions)
    correlated = atoms.conj().T @ atom
    inverse_rho = NOISE_PRECISION * np.vdot(atom, atom).real
    inverse_rho -= NOISE_PRECISION**2 * np.vdot(correlated, covariance @ correlated).real
    innovation = NOISE_PRECISION * np.vdot(atom, residual - atoms @ mean)
    return abs(innovation) ** 2 / inverse_rho, inverse_rho


def dense_selection(templates, channel, residual):
    """The same additions, one after the other, with every matrix inverted anew."""
    chosen = list(zip(channel.owners.tolist(), channel.bins.tolist(), strict=True))
    precisions, ratios = channel.precisions.tolist(), []
    for burst in range(len(templates)):
        for _ in range(MOST):
            columns = [column(templates, *each) for each in chosen]
            passive = [k for k in range(NUM_BINS) if (burst, k) not in chosen]
            found = [
                (*dense_ratio(column(templates, burst, k), columns, residual, precisions), k)
                for k in passive
            ]
            ratio, inverse_rho, best = max(found)
            if ratio <= THRESHOLD:
                break
            chosen.append((burst, best))
            precisions.append(inverse_rho / (ratio - 1.0))
            ratios.append(ratio)
    return chosen, precisions, ratios


def test_added_bins_are_those_of_the_dense_formulas(ramp):
    templates, channel, residual = ramp
    products = products_of(templates, residual)
    found, ratios, fit = with_best_bins(products, 2, channel, NOISE_PRECISION, THRESHOLD, MOST)
    chosen, precisions, expected = dense_selection(templates, channel, residual)
    assert len(expected) > MOST  # both bursts take part
    assert list(zip(found.owners.tolist(), found.bins.tolist(), strict=True)) == chosen
    np.testing.assert_allclose(found.precisions, precisions, rtol=1e-9)
    np.testing.assert_allclose(ratios[: len(chosen)], [0.0, 0.0, *expected], rtol=1e-9)
    columns = [column(templates, *each) for each in chosen]
    _, covariance, mean = dense_posterior(columns, residual, precisions)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=0, atol=1e-11)
    np.testing.assert_allclose(fit.amplitudes, mean, rtol=0, atol=1e-10)


def test_turns_of_the_columns_are_those_of_leaving_one_out(ramp):
    templates, channel, residual = ramp
    products = products_of(templates, residual)
    found, _, fit = with_best_bins(products, 2, channel, NOISE_PRECISION, THRESHOLD, MOST)
    precisions, kept, ratios = reestimate_precisions(fit, found.precisions, THRESHOLD)
    columns = [
        column(templates, *each)
        for each in zip(found.owners.tolist(), found.bins.tolist(), strict=True)
    ]
    now = found.precisions.tolist()
    gone = set()
    for index, atom in enumerate(columns):
        others = [k for k in range(len(columns)) if k != index and k not in gone]
        ratio, inverse_rho = dense_ratio(
            atom, [columns[k] for k in others], residual, [now[k] for k in others]
        )
        assert ratios[index] == pytest.approx(ratio, rel=1e-8)
        assert kept[index] == (ratio > THRESHOLD)
        if kept[index]:
            now[index] = inverse_rho / (ratio - 1.0)
            assert precisions[index] == pytest.approx(now[index], rel=1e-8)
        else:
            gone.add(index)


def test_log_evidence_is_that_of_the_posterior():
    rng = np.random.default_rng(8)
    atoms = random_complex(rng, NUM_SAMPLES, 5)
    gram, projections = atoms.conj().T @ atoms, atoms.conj().T @ random_complex(rng, NUM_SAMPLES)
    precisions = rng.uniform(0.1, 2.0, 5)
    covariance = np.linalg.inv(NOISE_PRECISION * gram + np.diag(precisions))
    explained = NOISE_PRECISION**2 * np.vdot(projections, covariance @ projections).real
    factor = inverse_factor(gram, precisions, NOISE_PRECISION)
    found = log_evidence(projections, factor, NOISE_PRECISION)
    assert found == pytest.approx(np.linalg.slogdet(covariance)[1] + explained, rel=1e-12)
    fit = weight_posterior(gram, projections, precisions, NOISE_PRECISION)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-10, atol=1e-15)
