"""Object atoms against the Kronecker form (10) of the paper."""

import numpy as np

from vsep.signal.atoms import gram, line_factors, project, synthesize

SHAPE = (5, 12)
BEATS, DOPPLERS = np.array([0.1, -0.33, 0.49]), np.array([0.0, 0.25, -0.5])


def kronecker_atoms():
    ramps, samples = np.arange(SHAPE[0]), np.arange(SHAPE[1])
    columns = [
        np.kron(np.exp(-2j * np.pi * d * ramps), np.exp(-2j * np.pi * b * samples))
        for b, d in zip(BEATS, DOPPLERS, strict=True)
    ]
    return np.stack(columns, axis=1) / np.sqrt(SHAPE[0] * SHAPE[1])


def factors():
    return line_factors(BEATS, SHAPE[1]), line_factors(DOPPLERS, SHAPE[0])


def test_ravelled_signal_is_the_stacked_vector_of_the_paper():
    amplitudes = np.array([1.0, 2j, -0.5 + 1j])
    expected = kronecker_atoms() @ amplitudes
    np.testing.assert_allclose(synthesize(amplitudes, *factors()).ravel(), expected, atol=1e-14)


def test_projection_is_the_adjoint_of_synthesis():
    rng = np.random.default_rng(0)
    signal = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    weights = rng.standard_normal(3) + 1j * rng.standard_normal(3)
    forward = np.vdot(signal, synthesize(weights, *factors()))
    backward = np.vdot(project(signal, *factors()), weights)
    assert abs(forward - backward) < 1e-12 * abs(forward)


def test_gram_equals_the_dense_product():
    atoms = kronecker_atoms()
    np.testing.assert_allclose(gram(*factors()), atoms.conj().T @ atoms, atol=1e-14)
