"""Standard deviations against a numerical Fisher information of the full model."""

import numpy as np
import pytest

from vsep.inference.objects.uncertainty import (
    _inverse_diagonal,
    dispersion_std,
    fisher_information,
)
from vsep.inference.objects.workspace import no_objects


def numeric_bound(beats, dopplers, amplitudes, noise_precision, shape):
    """CRLB of beats (and Dopplers) with real and imaginary weights as nuisance, by differences."""
    ramps, samples = np.arange(shape[0])[:, None], np.arange(shape[1])[None, :]
    num_objects = len(beats)

    def signal(parameters):
        b, d, re, im = np.split(parameters, 4)
        terms = [
            (re[i] + 1j * im[i]) * np.exp(-2j * np.pi * (d[i] * ramps + b[i] * samples))
            for i in range(num_objects)
        ]
        return np.sum(terms, axis=0).ravel() / np.sqrt(shape[0] * shape[1])

    point = np.concatenate([beats, dopplers, amplitudes.real, amplitudes.imag])
    free = np.ones(len(point), dtype=bool)
    if shape[0] == 1:
        free[num_objects : 2 * num_objects] = False
    step = 1e-6
    jacobian = np.stack(
        [
            (signal(point + step * e) - signal(point - step * e)) / (2 * step)
            for e in np.eye(len(point))[free]
        ],
        axis=1,
    )
    fisher = 2.0 * noise_precision * (jacobian.conj().T @ jacobian).real
    return np.sqrt(np.diagonal(np.linalg.inv(fisher)))


@pytest.mark.parametrize("shape", [(1, 64), (8, 32)])
def test_fisher_information_equals_the_numerical_one(shape):
    beats, dopplers = np.array([0.1, 0.125, -0.3]), np.array([0.2, 0.15, -0.4])
    if shape[0] == 1:
        dopplers = np.zeros(3)
    amplitudes = np.array([1.0 + 0.5j, -0.7j, 0.4 + 0j])
    fisher = fisher_information(beats, dopplers, amplitudes, np.zeros(3), 100.0, shape)
    found = np.sqrt(np.diagonal(np.linalg.inv(fisher)))
    expected = numeric_bound(beats, dopplers, amplitudes, 100.0, shape)[: len(found)]
    # Central differences of phases up to 2 pi 64 with a step of 1e-6 err by 3e-8 relative.
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_no_object_has_no_deviation():
    std = dispersion_std(no_objects(), 1.0, (4, 16))
    assert len(std.beats) == len(std.dopplers) == 0


@pytest.mark.parametrize("rounded", [0.0, -1e-17, -10.0])
def test_what_has_no_information_leaves_the_others_as_they_are(rounded):
    information = np.array([[4.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, rounded]])
    found = _inverse_diagonal(information)
    np.testing.assert_allclose(found, [2.0 / 7.0, 4.0 / 7.0, 0.0], rtol=1e-12)


@pytest.mark.parametrize("shape", [(1, 64), (8, 32)])
def test_what_antennas_tell_adds_up(shape):
    rng = np.random.default_rng(7)
    beats, dopplers = np.array([0.1, 0.125, -0.3]), np.array([0.2, 0.15, -0.4])
    amplitudes = rng.standard_normal((3, 4)) + 1j * rng.standard_normal((3, 4))
    precisions = np.array([0.1, 0.2, 0.3])
    common = precisions, 100.0, shape
    together = fisher_information(beats, dopplers, amplitudes, *common)
    alone = [fisher_information(beats, dopplers, weights, *common) for weights in amplitudes.T]
    np.testing.assert_allclose(together, np.sum(alone, axis=0), rtol=1e-9, atol=1e-6)
