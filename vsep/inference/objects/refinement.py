"""Posterior of the object weights at given frequencies, and a joint refinement by (67)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgesv

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.objects.measurement_vectors import MultipleVectorActiveSet
from vsep.inference.objects.sbl import ActiveSet
from vsep.kernels import joint_slopes as slopes
from vsep.kernels.line_spectra import Columns
from vsep.kernels.moving_atoms import STATIONARY
from vsep.kernels.newton_ascent import MAX_STEP_CELLS, NO_GAIN
from vsep.kernels.object_posterior import (
    ObjectPosterior,
    columns_posterior,
    place_columns,
    place_moving_columns,
)
from vsep.kernels.posterior import Posterior
from vsep.signal.atoms import Factors, line_factors
from vsep.signal.dithered_atoms import Coupling, RampDither, coupled_jets, coupled_products

LARGE = 2**20  # objects times samples: with fewer, one more is placed as fast with all the others


@dataclass(frozen=True, slots=True, eq=False)
class PlacedComponents:
    """Points (L, 2) of the objects, with the factors of all columns and their posterior.

    The first L columns are the objects. Further ones, the background, keep their place while the
    objects move; the factorised separator has none, the joint one has the interference there.
    """

    points: FloatArray
    factors: Factors
    active: ActiveSet
    migration: Coupling = STATIONARY

    @property
    def background(self) -> Factors:
        """Factors of the columns that do not move."""
        count = len(self.points)
        return self.factors[0][count:], self.factors[1][count:]

    @property
    def columns(self) -> Columns:
        """All columns and their posterior in the form of the kernels."""
        active = self.active
        migration = self.migration
        if isinstance(migration, RampDither):
            migration = STATIONARY
        weights = active.amplitudes if active.amplitudes.ndim == 2 else active.amplitudes[:, None]
        return Columns(
            *self.factors,
            active.covariance,
            weights,
            active.noise_precision,
            self.points,
            migration if migration.coupling != 0.0 else None,
        )


def place_components(
    points: FloatArray,
    precisions: FloatArray,
    residual: ComplexArray,
    noise_precision: float,
    background: Factors,
    migration: Coupling = STATIONARY,
) -> PlacedComponents:
    """Posterior of all columns with the objects at the given points.

    Parameters
    ----------
    points : (L, 2) float
        Beats and Dopplers.
    precisions : (L + M,) float
        Prior precisions of the objects, then of the background.
    residual : (P, N) or, of several antennas, (A P, N) complex
        Received signal minus what is not among the columns.
    noise_precision : float
        lambda.
    background : tuple of (M, N) and (M, P) complex
        Separable columns that do not move; also the size of a frame, where there are none.
    migration : Migration
        How objects move through range cells; without a background only.

    Raises
    ------
    LinAlgError
        If the precision matrix is not positive definite.
    """
    # C from (59), alpha from (58)
    if migration.coupling == 0.0:
        placed = place_columns(points, background, precisions, residual, noise_precision)
    elif isinstance(migration, RampDither):
        placed = _place_dithered_columns(points, precisions, residual, noise_precision, migration)
    else:
        num_ramps = background[1].shape[1]
        placed = place_moving_columns(
            points, num_ramps, precisions, residual, noise_precision, migration
        )
    factors = placed.beat_factors, placed.doppler_factors
    projections, amplitudes = placed.projections, placed.amplitudes
    kind: type[ActiveSet] = MultipleVectorActiveSet
    if len(residual) == background[1].shape[1]:  # one antenna
        kind, projections, amplitudes = ActiveSet, projections[:, 0], amplitudes[:, 0]
    fit = Posterior(placed.gram, projections, placed.covariance, amplitudes, placed.log_determinant)
    active = kind.fitted(fit, precisions, noise_precision)
    return PlacedComponents(points, factors, active, migration)


def with_component(
    placed: PlacedComponents, point: FloatArray, precision: float, residual: ComplexArray
) -> PlacedComponents:
    """Return the columns with one more component behind them.

    By block inversion (68) where that spares much; parameters as for `place_components`.
    """
    points = np.concatenate([placed.points, point[None]])
    active, (beats, dopplers) = placed.active, placed.factors
    count, size = len(placed.points), len(points) * residual.size
    alone = len(active) == count and len(residual) == dopplers.shape[1]  # one source, one antenna
    if placed.migration.coupling != 0.0 or not alone or size < LARGE:
        return place_components(
            points,
            np.insert(active.precisions, count, precision),
            residual,
            active.noise_precision,
            placed.background,
            placed.migration,
        )
    beat, doppler = line_factors(point[:1], beats.shape[1]), line_factors(point[1:], len(residual))
    correlations = (beats.conj() @ beat[0]) * (dopplers.conj() @ doppler[0])
    projection = complex(np.vdot(doppler[0], residual @ beat[0].conj()))
    factors = np.concatenate([beats, beat]), np.concatenate([dopplers, doppler])
    grown = active.inserted(count, correlations, projection, 1.0, precision)
    return PlacedComponents(points, factors, grown, placed.migration)


def _place_dithered_columns(
    points: FloatArray,
    precisions: FloatArray,
    residual: ComplexArray,
    noise_precision: float,
    dither: RampDither,
) -> ObjectPosterior:
    """Posterior (58)-(59) of objects that dithered ramps see; as `place_moving_columns`."""
    num_ramps, num_samples = len(dither.start_ramps), residual.shape[1]
    return columns_posterior(
        np.zeros((len(points), num_samples), dtype=np.complex128),
        np.zeros((len(points), num_ramps), dtype=np.complex128),
        coupled_jets(points, dither, num_ramps, num_samples, 1)[0],
        np.ascontiguousarray(coupled_products(points, dither, num_ramps, residual)),
        precisions,
        noise_precision,
    )


def joint_slopes(placed: PlacedComponents, residual: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Gradient of (67) by all beats, then (for several ramps) all Dopplers, and its curvature."""
    return slopes.joint_slopes(len(placed.points), residual, placed.columns)


def joint_step(placed: PlacedComponents, residual: ComplexArray) -> PlacedComponents:
    """One damped Gauss-Newton step of all objects together; the joint cost never falls.

    Moving one component at a time converges slowly where several share a resolution cell; the
    Fisher information knows their coupling.
    """
    active, count = placed.active, len(placed.points)
    if count < 2 or not active.amplitudes.all():
        return placed
    gradient, curvature = joint_slopes(placed, residual)  # gradient of (67), Fisher information
    # LAPACK directly: for matrices this small its wrappers cost more than the algebra.
    *_, step, failed = dgesv(curvature, gradient)
    if failed or gradient @ step < 2.0 * NO_GAIN:
        return placed  # nothing to gain, as always where components coincide
    # All components keep within a quarter of a cell.
    steps = np.zeros((count, 2))
    steps[:, : len(step) // count] = step.reshape(-1, count).T
    cells = placed.factors[0].shape[1], placed.factors[1].shape[1]
    longest = float((abs(steps) * cells).max())
    steps *= min(1.0, MAX_STEP_CELLS / max(longest, 1e-300))
    cost = active.cost()  # (67)
    for _ in range(3):
        trial = place_components(
            placed.points + steps,
            active.precisions,
            residual,
            active.noise_precision,
            placed.background,
            placed.migration,
        )
        if trial.active.cost() >= cost:  # backtracking: the joint cost never falls
            return trial
        steps = 0.25 * steps
    return placed
