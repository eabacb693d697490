"""Algorithm 4 against dense formulas: every fast update equals the full inverse."""

import numpy as np
import pytest

from vsep.inference.objects.sbl import ActiveSet, activation_ratio, converged_precision

NOISE_PRECISION = 7.0


def dense_problem(num_atoms, seed=3, length=40):
    rng = np.random.default_rng(seed)
    atoms = rng.standard_normal((length, num_atoms)) + 1j * rng.standard_normal((length, num_atoms))
    atoms /= np.linalg.norm(atoms, axis=0)
    residual = rng.standard_normal(length) + 1j * rng.standard_normal(length)
    precisions = rng.uniform(0.1, 3.0, num_atoms)
    return atoms, residual, precisions


def active_set(atoms, residual, precisions):
    return ActiveSet(atoms.conj().T @ atoms, atoms.conj().T @ residual, precisions, NOISE_PRECISION)


def dense_posterior(atoms, residual, precisions):
    gram = atoms.conj().T @ atoms
    covariance = np.linalg.inv(NOISE_PRECISION * gram + np.diag(precisions))
    return covariance, NOISE_PRECISION * covariance @ atoms.conj().T @ residual


def assert_posterior(active, atoms, residual, precisions):
    covariance, amplitudes = dense_posterior(atoms, residual, precisions)
    # 40 x 5 well-conditioned problems: rounding of a few hundred operations on values of order 1.
    np.testing.assert_allclose(active.covariance, covariance, rtol=0, atol=1e-13)
    np.testing.assert_allclose(active.amplitudes, amplitudes, rtol=0, atol=1e-13)
    log_determinant = np.linalg.slogdet(covariance)[1]
    assert active.log_determinant == pytest.approx(log_determinant, abs=1e-12)


def test_refresh_equals_the_direct_inverse():
    atoms, residual, precisions = dense_problem(5)
    assert_posterior(active_set(atoms, residual, precisions), atoms, residual, precisions)


def test_changed_precision_equals_the_direct_inverse():
    atoms, residual, precisions = dense_problem(5)
    active = active_set(atoms, residual, precisions)
    active.set_precision(2, 40.0)
    changed = np.concatenate([precisions[:2], [40.0], precisions[3:]])
    assert_posterior(active, atoms, residual, changed)


@pytest.mark.parametrize("index", [0, 2, 4])
def test_removed_component_equals_the_direct_inverse(index):
    atoms, residual, precisions = dense_problem(5)
    active = active_set(atoms, residual, precisions).without(index)
    keep = np.arange(5) != index
    assert_posterior(active, atoms[:, keep], residual, precisions[keep])


@pytest.mark.parametrize("index", [0, 2, 4])
def test_inserted_component_equals_the_direct_inverse(index):
    atoms, residual, precisions = dense_problem(5)
    keep = np.arange(5) != index
    fewer = active_set(atoms[:, keep], residual, precisions[keep])
    new = 1.3 * atoms[:, index]
    active = fewer.inserted(
        index,
        atoms[:, keep].conj().T @ new,
        complex(np.vdot(new, residual)),
        float(np.vdot(new, new).real),
        float(precisions[index]),
    )
    atoms[:, index] = new
    assert_posterior(active, atoms, residual, precisions)


def test_flat_prior_moments_equal_leave_one_out_formulas_23_and_24():
    atoms, residual, precisions = dense_problem(5)
    active = active_set(atoms, residual, precisions)
    for index in range(5):
        keep = np.arange(5) != index
        covariance, _ = dense_posterior(atoms[:, keep], residual, precisions[keep])
        atom, others = atoms[:, index], atoms[:, keep]
        correlated = atom.conj() @ others @ covariance @ others.conj().T
        rho = (
            1.0
            / (NOISE_PRECISION * np.vdot(atom, atom) - NOISE_PRECISION**2 * correlated @ atom).real
        )
        omega = NOISE_PRECISION * rho * np.vdot(atom, residual)
        omega -= NOISE_PRECISION**2 * rho * correlated @ residual
        assert active.flat_prior_moments(index) == pytest.approx((rho, abs(omega) ** 2), rel=1e-11)


def test_converged_precision_is_the_fixed_point_of_the_variational_update():
    atoms, residual, precisions = dense_problem(3)
    residual = residual + 5.0 * atoms[:, 1]
    active = active_set(atoms, residual, precisions)
    rho, omega_sq = active.flat_prior_moments(1)
    active.set_precision(1, converged_precision(rho, omega_sq))
    # (75): gamma = 1 / (|alpha|^2 + C_ll) leaves it where it is
    again = 1.0 / (abs(active.amplitudes[1]) ** 2 + active.covariance[1, 1].real)
    assert again == pytest.approx(active.precisions[1], rel=1e-12)


def test_fixed_point_exists_only_above_a_ratio_of_one():
    # Iterating (75) for a component below the test must let gamma diverge, above it must not.
    for gain, diverges in ((0.2, True), (3.0, False)):
        gram, noise = np.ones((1, 1), dtype=complex), 1.0
        active = ActiveSet(gram, np.array([gain + 0j]), np.array([1.0]), noise)
        assert (activation_ratio(*active.flat_prior_moments(0)) < 1.0) == diverges
        for _ in range(200):
            moment = abs(active.amplitudes[0]) ** 2 + active.covariance[0, 0].real
            active.set_precision(0, 1.0 / moment)
        assert (active.precisions[0] > 50.0) == diverges


def test_a_weight_the_others_explain_has_no_activation():
    atoms, residual, _ = dense_problem(2)
    atoms[:, 1] = atoms[:, 0]
    active = active_set(atoms, residual, np.array([1e-14, 1e-3]))
    assert activation_ratio(*active.flat_prior_moments(1)) < 1e-3


def test_no_component_is_a_posterior_too():
    empty = ActiveSet(np.zeros((0, 0), dtype=complex), np.zeros(0, dtype=complex), np.zeros(0), 1.0)
    assert len(empty) == 0
    assert empty.trace() == 0.0
    one = empty.inserted(0, np.zeros(0, dtype=complex), 3 + 0j, 1.0, 0.5)
    assert one.amplitudes[0] == pytest.approx(2.0)
