"""Sparse Bayesian learning of one source: Algorithm 4 with (23), (24), and weights (58)-(62).

Both sources, the object channel and the interference channel of a ramp, are linear models
``residual = A weights + noise`` with independent priors ``CN(0, 1/precision)``. Everything is
expressed by the Gram matrix ``A^H A`` and the projections ``A^H residual`` of the active
components, so that the cost of an update does not depend on the number of samples.
"""

import math

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import zpotrf, zpotri

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.posterior import Posterior


class ActiveSet:
    """Weight posterior of the active components; a working copy that lives inside one step.

    Parameters
    ----------
    gram : (K, K) complex
        A^H A.
    projections : (K,) complex
        A^H residual, where the residual lacks the *other* source.
    precisions : (K,) float
        Prior precisions gamma.
    noise_precision : float
        lambda.

    Attributes
    ----------
    covariance : (K, K) complex
        (59) or (62).
    amplitudes : (K,) complex
        Posterior mean (58) or (61).
    log_determinant : float
        log|C|.

    Examples
    --------
    >>> import numpy as np
    >>> one = ActiveSet(np.eye(1, dtype=complex), np.array([3 + 0j]), np.array([0.5]), 2.0)
    >>> np.round(one.covariance, 12), np.round(one.amplitudes, 12)
    (array([[0.4+0.j]]), array([2.4+0.j]))
    """

    def __init__(
        self,
        gram: ComplexArray,
        projections: ComplexArray,
        precisions: FloatArray,
        noise_precision: float,
    ) -> None:
        self.gram = gram
        self.projections = projections
        self.precisions = precisions
        self.noise_precision = noise_precision
        self.refresh()

    @classmethod
    def fitted(cls, fit: Posterior, precisions: FloatArray, noise_precision: float) -> "ActiveSet":
        """Make the set from a posterior that a kernel has computed.

        Raises
        ------
        LinAlgError
            If its precision matrix was not positive definite.
        """
        if not math.isfinite(fit.log_determinant):
            raise LinAlgError("the precision matrix is not positive definite")
        active = cls.__new__(cls)
        active.gram, active.projections = fit.gram, fit.projections
        active.precisions, active.noise_precision = precisions, noise_precision
        active.covariance, active.amplitudes = fit.covariance, fit.amplitudes
        active.log_determinant = fit.log_determinant
        return active

    def __len__(self) -> int:
        """Return the number of active components."""
        return len(self.precisions)

    def refresh(self) -> None:
        """Recompute covariance and mean from the precision matrix, (58)-(59); O(K^3)."""
        if len(self) == 0:
            self.covariance = np.zeros((0, 0), dtype=np.complex128)
            self.amplitudes = np.zeros(0, dtype=np.complex128)
            self.log_determinant = 0.0
            return
        precision_matrix = self.noise_precision * self.gram  # lambda A^H A, (59)
        precision_matrix[np.diag_indices(len(self))] += self.precisions  # + diag(gamma)
        # LAPACK directly: for matrices this small its wrappers cost more than the algebra.
        factor, failed = zpotrf(precision_matrix.T, lower=False, overwrite_a=True)
        if failed:
            raise LinAlgError(f"the precision matrix is not positive definite at row {failed}")
        # log|C| from the Cholesky factor
        self.log_determinant = -2.0 * float(np.sum(np.log(np.diagonal(factor).real)))
        # The upper half of the transposed inverse; zpotrf has cleaned the lower one.
        upper, _ = zpotri(factor, lower=False, overwrite_c=True)
        upper[np.diag_indices(len(self))] *= 0.5
        self.covariance = np.add(upper.T, upper.conj(), order="C")
        self.amplitudes = self.noise_precision * (self.covariance @ self.projections)  # (58)

    def flat_prior_moments(self, index: int) -> tuple[float, float]:
        """Variance rho and power omega^2 of weight `index` if its own precision were zero.

        With all components active, ``1/C_ll = 1/rho + gamma_l`` and
        ``alpha_l / C_ll = omega / rho``, which is (23)-(24) without forming the leave-one-out
        inverse. A weight that the others explain completely has ``rho = inf``.
        """
        variance = float(self.covariance[index, index].real)  # C_ll
        inverse_rho = 1.0 / variance - float(self.precisions[index])  # (23)
        if inverse_rho <= 0.0:
            return float("inf"), 0.0
        rho = 1.0 / inverse_rho
        return rho, abs(self.amplitudes[index]) ** 2 * (rho / variance) ** 2  # (24)

    def set_precision(self, index: int, precision: float) -> None:
        """Change one prior precision: rank-one update of covariance and mean, O(K^2)."""
        change = precision - float(self.precisions[index])
        column = self.covariance[:, index].copy()
        # Sherman-Morrison: C - g c_l c_l^H with g = d / (1 + d C_ll)
        gain = change / (1.0 + change * float(column[index].real))
        self.amplitudes = self.amplitudes - (gain * self.amplitudes[index]) * column
        self.covariance = self.covariance - gain * np.outer(column, column.conj())
        # matrix determinant lemma
        self.log_determinant -= float(np.log1p(change * column[index].real))
        self.precisions = self.precisions.copy()
        self.precisions[index] = precision

    def without(self, index: int) -> "ActiveSet":
        """Posterior of the other components *as if* component `index` were not there, O(K^2)."""
        keep = np.arange(len(self)) != index
        column = self.covariance[keep, index]
        variance = float(self.covariance[index, index].real)
        others = object.__new__(ActiveSet)
        others.gram = self.gram[np.ix_(keep, keep)]
        others.projections = self.projections[keep]
        others.precisions = self.precisions[keep]
        others.noise_precision = self.noise_precision
        others.amplitudes = self.amplitudes[keep] - column * (self.amplitudes[index] / variance)
        others.covariance = (
            self.covariance[np.ix_(keep, keep)] - np.outer(column, column.conj()) / variance
        )
        others.log_determinant = self.log_determinant - float(np.log(variance))
        return others

    def inserted(
        self,
        index: int,
        correlations: ComplexArray,
        projection: complex,
        norm: float,
        precision: float,
    ) -> "ActiveSet":
        """Posterior with one more component at position `index`, by block inversion (68), O(K^2).

        Parameters
        ----------
        index : int
            Position of the new component.
        correlations : (K,) complex
            ``A^H a`` with the new column a.
        projection : complex
            ``a^H residual``.
        norm : float
            ``a^H a``.
        precision : float
            Prior precision of the new weight.
        """
        noise_precision = self.noise_precision
        regression = noise_precision * (self.covariance @ correlations)  # lambda C A^H a
        schur = noise_precision * norm + precision  # lambda a^H a + gamma, c^-1 of (68)
        # - lambda^2 a^H A C A^H a
        schur -= noise_precision * float(np.vdot(correlations, regression).real)
        variance = 1.0 / schur  # c' of (68)
        innovation = projection - np.vdot(correlations, self.amplitudes)  # a^H (r - A mean)
        amplitude = noise_precision * variance * innovation
        size = len(self) + 1
        old = np.arange(size) != index
        new = object.__new__(ActiveSet)
        new.noise_precision = noise_precision
        new.gram = np.empty((size, size), dtype=np.complex128)
        new.gram[np.ix_(old, old)] = self.gram
        new.gram[old, index] = correlations
        new.gram[index, old] = correlations.conj()
        new.gram[index, index] = norm
        new.projections = np.insert(self.projections, index, projection)
        new.precisions = np.insert(self.precisions, index, precision)
        new.covariance = np.empty((size, size), dtype=np.complex128)
        new.covariance[np.ix_(old, old)] = self.covariance + variance * np.outer(
            regression, regression.conj()
        )
        new.covariance[old, index] = -variance * regression
        new.covariance[index, old] = -variance * regression.conj()
        new.covariance[index, index] = variance
        new.amplitudes = np.insert(self.amplitudes - regression * amplitude, index, amplitude)
        new.log_determinant = self.log_determinant + float(np.log(variance))
        return new

    def cost(self) -> float:
        """Log evidence of the non-linear parameters, (67) or (71): ``log|C| + lambda h^H mean``."""
        return self.log_determinant + self.explained()

    def explained(self) -> float:
        """Return what the weights explain, lambda h^H mean with h = A^H r, in nats."""
        return self.noise_precision * float(np.vdot(self.projections, self.amplitudes).real)

    def trace(self) -> float:
        """tr(A C A^H), the expected energy of the weights' uncertainty in (65)."""
        return float(np.vdot(self.gram, self.covariance).real)


def activation_ratio(rho: float, omega_sq: float) -> float:
    """omega^2 / rho, compared with the threshold; the component SNR is this minus one."""
    return omega_sq / rho if math.isfinite(rho) else 0.0


def converged_precision(rho: float, omega_sq: float) -> float:
    """Return the fixed point ``1 / (omega^2 - rho)`` of the precision update, (77)."""
    return 1.0 / (omega_sq - rho)
