"""Approximate message passing: AMP (soft threshold) and GAMP (Bernoulli-Gaussian prior).

Both add to the residual a memory term that removes, on average, what the estimate of a cell has put
into its own pseudo-measurement; what disturbs a cell is then close to white Gaussian noise of a
known level. The theory wants columns of unit norm and independent entries: the squared norm of the
columns of A is delta = q/PN, which is divided out, and bursts are blocks, against which damping
helps (AMP) or a slowly falling noise level (GAMP).
"""

import math
from dataclasses import dataclass

import numpy as np

from vsep._typing import FloatArray
from vsep.mitigation.sparse.filling import sparse_entry
from vsep.mitigation.sparse.operators import Samples, SensingOperator
from vsep.mitigation.sparse.solver import Solver, SolverState, zero_spectrum
from vsep.mitigation.sparse.thresholding import SOFT_CONTROL, soft_threshold

_SAFE_SHARE = 0.5  # with fewer clean samples than this undamped AMP can diverge
_RARE = 1e-6  # bounds the share of occupied cells away from none and from all


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class AmpState(SolverState):
    """Spectrum with the corrected residual."""

    residual: Samples  #: z_t, residual with the memory term


@dataclass(frozen=True, kw_only=True, slots=True)
class Amp(Solver):
    """AMP with the complex soft threshold."""

    control: float = 2.0  #: the threshold in units of the noise of the pseudo-measurement
    #: share of a new residual that is taken where at most half of the samples are clean
    damping: float = 0.7

    def init(self, operator: SensingOperator, measured: Samples) -> AmpState:
        """Zero spectrum; the residual is the measurement."""
        return AmpState(
            spectrum=zero_spectrum(operator, measured), may_stop=True, residual=measured
        )

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> AmpState:
        """Threshold the pseudo-measurement x + A^H z / delta, then correct the residual."""
        assert isinstance(state, AmpState)
        share = operator.num_measurements / operator.num_cells
        pseudo = state.spectrum + operator.adjoint(state.residual) / share
        power = float(np.vdot(state.residual, state.residual).real)
        noise = float(np.sqrt(power / operator.num_measurements / share))
        threshold = self.control * noise
        spectrum = soft_threshold(pseudo, threshold)
        memory = _mean_slope(pseudo, threshold) / share
        residual = measured - operator.forward(spectrum) + memory * state.residual
        if share <= _SAFE_SHARE:
            residual = self.damping * residual + (1.0 - self.damping) * state.residual
        return AmpState(spectrum=spectrum, may_stop=True, residual=residual)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class GampState(SolverState):
    """Posterior of the cells and the three learned parameters."""

    scaled_residual: Samples  #: s of GAMP
    variance: float  #: mean posterior variance of a cell
    #: noise power of a sample, share of occupied cells, power of an occupied one
    noise_power: float
    occupied: float
    cell_power: float
    floor: float  #: the schedule's lower bound on the variance of the next pseudo-measurement


@dataclass(frozen=True, kw_only=True, slots=True)
class Gamp(Solver):
    """Sum-product GAMP, one variance for all cells, parameters by expectation maximisation."""

    initial_occupied: float = 0.01  #: share of occupied cells that the first iteration assumes
    #: factor of the schedule. Taken as known, the variance of the pseudo-measurement says that the
    #: side lobes of the mask are objects, and as with plain IHT they stay; so it starts where only
    #: the strongest cell stands out and falls by the square of this factor.
    decay: float = 0.9

    def init(self, operator: SensingOperator, measured: Samples) -> GampState:
        """Zero spectrum; a hundredth of the mean power counts as noise."""
        zero = zero_spectrum(operator, measured)
        peak = float(np.abs(operator.adjoint(measured)).max(initial=0.0))
        power = float(np.vdot(measured, measured).real) / operator.num_measurements
        return GampState(
            spectrum=zero,
            may_stop=True,
            scaled_residual=np.zeros_like(measured),
            variance=power,
            noise_power=0.01 * power,
            occupied=self.initial_occupied,
            cell_power=power / self.initial_occupied,
            floor=peak**2 / math.log(operator.num_cells),
        )

    def step(self, operator: SensingOperator, measured: Samples, state: SolverState) -> GampState:
        """Output step, input step, and the three parameters from their posteriors."""
        assert isinstance(state, GampState)
        if state.cell_power == 0.0:
            return state
        share = operator.num_measurements / operator.num_cells
        predicted = operator.forward(state.spectrum) - state.variance * state.scaled_residual
        # The schedule counts as noise, in the samples as in the cells.
        noise = max(state.noise_power, share * state.floor - state.variance)
        total = state.variance + noise
        error = measured - predicted
        scaled = error / total
        pseudo_variance = total / share
        pseudo = state.spectrum + pseudo_variance * operator.adjoint(scaled)
        mean, probability, variances = _bernoulli_gaussian(pseudo, pseudo_variance, state)
        error_power = float(np.vdot(error, error).real) / operator.num_measurements
        noise_power = noise * (noise * error_power / total + state.variance) / total
        occupied = float(probability.mean(dtype=np.float64))
        variance = float(variances.mean(dtype=np.float64))
        energy = float(np.vdot(mean, mean).real) / mean.size + variance
        return GampState(
            spectrum=mean,
            may_stop=share * state.floor <= state.variance + state.noise_power,
            scaled_residual=scaled,
            variance=variance,
            noise_power=noise_power,
            occupied=min(max(occupied, _RARE), 1.0 - _RARE),
            cell_power=energy / max(occupied, _RARE),
            floor=self.decay**2 * state.floor,
        )


def _mean_slope(values: Samples, threshold: float) -> float:
    """Mean divergence of the complex soft threshold: 1 - lambda / (2 abs(v)) where it passes."""
    magnitude = np.abs(values)
    passed = magnitude[magnitude > threshold]
    return float(np.sum(1.0 - 0.5 * threshold / passed, dtype=np.float64)) / values.size


def _bernoulli_gaussian(
    pseudo: Samples, pseudo_variance: float, state: GampState
) -> tuple[Samples, FloatArray, FloatArray]:
    """Posterior mean, probability of being occupied, and variance of every cell."""
    total = state.cell_power + pseudo_variance
    gain = state.cell_power / total
    odds_exponent = np.abs(pseudo) ** 2 * (gain / pseudo_variance)
    bias = np.log((1.0 - state.occupied) / state.occupied * (total / pseudo_variance))
    # Beyond 60 the exponential is below the rounding of one, and may not overflow.
    odds = np.exp(np.clip(float(bias) - odds_exponent, -60.0, 60.0))
    probability = 1.0 / (1.0 + odds)
    value = gain * pseudo
    # As a sum of positive terms: a difference of moments would be lost in single precision.
    variance = probability * (gain * pseudo_variance + odds * probability * np.abs(value) ** 2)
    return probability * value, probability, variance


ENTRIES = (
    sparse_entry(
        "amp",
        "AMP",
        180,
        "Approximate message passing with a soft threshold.",
        solver=Amp(control=SOFT_CONTROL),
    ),
    sparse_entry(
        "gamp",
        "GAMP",
        190,
        "Generalised approximate message passing with a Bernoulli-Gaussian prior.",
        solver=Gamp(),
    ),
)
