"""Phase of the own oscillator over a frame, from objects that are common to all of it.

Where objects are x(n, p) and the frame, before any phase is taken off it, is x + e, the products
``v = conj(x) e`` are about ``j theta |x|^2`` and noise of variance ``|x|^2 / lambda``. What turns x
makes their imaginary part large, what is not modelled (noise, another object, a burst) real and
imaginary part alike. Both tests rest on this, and so does the estimate of the autocovariance

    kappa(k) = -Re sum v(n) v(n + k) / sum |x(n)|^2 |x(n + k)|^2,

in which all circular noise cancels. With the prior fitted to it, theta is Gaussian: a constant of
every ramp, and a Markov process whose precision matrix has three diagonals.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft, special
from scipy.linalg import solveh_banded

from vsep._typing import ComplexArray, FloatArray
from vsep.inference.core.receiver import PhasePrior

FALSE_JITTER = 1e-4  # how often the F test of a single estimate finds jitter where there is none
STILL_JITTER = 1e-2  # likewise, where jitter has been found before
BLOCK = 8  # samples over which products are summed to look for phase noise
EVIDENT_NOISE = 6.0  # of its statistic, standard normal without phase noise ...
LEAST_TURNING = 1.5  # ... of all that turns, jitter too, without which it is not looked at ...
STILL_EVIDENT = 2.0  # ... and where it has been found before
NUM_WIDTHS, NARROWEST = 24, 0.25  # widths of the spectrum that are tried, the first in cells
LINE = 20.0  # times its expected power: one in 5e8 cells of the phases' spectrum is more
MOST_LINES = 8
# Of von Neumann's ratio, 2 where phases are independent from ramp to ramp, with a deviation of 0.46
# in 16 ramps: what follows a course is an object that walks or accelerates.
LEAST_STEPS = 0.6
CERTAIN_JITTER = 2.5  # deviations: less is what the process does to the ramps' means
LARGEST_STD = 0.5  # rad: phases beyond are no small errors
PRIOR_STEPS = 30


@dataclass(frozen=True, slots=True, eq=False)
class PhaseEstimate:
    """Most probable phases (P, 1) or (P, N), their prior, and how many they are in effect."""

    phases: FloatArray
    prior: PhasePrior
    num_effective: float


class PhaseProducts:
    """Products of objects and frame, of all antennas together.

    Parameters
    ----------
    signal, residual : (A, P, N) complex
        Objects x, and what they and the bursts leave of the frame without `phases`.
    phases : (P, 1) or (P, N) float
        What has been taken off the frame.
    noise_precision : float
        lambda.
    """

    def __init__(
        self,
        signal: ComplexArray,
        residual: ComplexArray,
        phases: FloatArray,
        noise_precision: float,
    ) -> None:
        self.products = (signal.conj() * residual).sum(axis=0)
        self.energy = (signal.real**2 + signal.imag**2).sum(axis=0)
        if phases.any():
            # conj(x) (exp(j theta) (x + e) - x)
            turned = np.exp(1j * phases)
            self.products = turned * self.products + (turned - 1.0) * self.energy
        self.noise_precision = noise_precision

    def estimate(self, *, within_ramps: bool, last: PhasePrior | None) -> PhaseEstimate | None:
        """Phases that are evident, None where there are none.

        Parameters
        ----------
        within_ramps : bool
            Whether phase noise is looked for, beside jitter.
        last : PhasePrior or None
            Of what was evident before, which needs less to stay so.
        """
        num_samples = self.products.shape[1]
        needed = STILL_EVIDENT if last is not None and last.noise_std > 0.0 else EVIDENT_NOISE
        if within_ramps and num_samples >= 4 * BLOCK and self._noise_statistic() > needed:
            prior = self._fitted_prior()
            if 0.0 < prior.noise_std < LARGEST_STD:
                phases = _without_lines(self._probable(prior), prior)
                return PhaseEstimate(phases, prior, self._num_effective(prior))
        return self._jitter(FALSE_JITTER if last is None else STILL_JITTER)

    def _jitter(self, rate: float) -> PhaseEstimate | None:
        """One phase a ramp, if the ramps turn by more than noise and by more than they stretch."""
        energy = self.energy.sum(axis=1)
        energy = np.maximum(energy, 1e-12 * energy.max())
        sums = self.products.sum(axis=1)
        phases = np.angle(energy + sums)
        information = 2.0 * self.noise_precision * energy
        limit_chi, limit_f = _limits(len(phases) - 2, rate)
        if information @ phases**2 < limit_chi:  # the usual case; without its trend it is less
            return None
        phases = _without_trend(phases, energy)
        turned = float(information @ phases**2)
        stretched = float(information @ _without_trend(sums.real / energy, energy) ** 2)
        if turned < limit_chi or turned < limit_f * stretched:
            return None
        steps = np.diff(phases)
        if steps @ steps < LEAST_STEPS * (phases @ phases):  # an object that moves, not jitter
            return None
        variance = _prior_variance(phases, 1.0 / information)
        if not 0.0 < variance < LARGEST_STD**2:
            return None
        share = variance / (variance + 1.0 / information)
        probable = _without_trend(share * phases, energy)
        prior = PhasePrior(jitter_std=math.sqrt(variance))
        return PhaseEstimate(probable[:, None], prior, float(share.sum()))

    def _noise_statistic(self) -> float:
        """Excess of turning over stretching in blocks of samples, without the mean of a ramp.

        Of differences from ramp to ramp: the process begins anew with each, what is left of an
        object beside the modelled ones hardly changes. Neighbouring differences share a ramp, which
        makes the variance of their squares' sum 1.5 times that of independent ones.
        """
        if _turning(self._blocks(self.products)) < LEAST_TURNING:
            return 0.0
        mean = self.products.sum(axis=1) / np.maximum(self.energy.sum(axis=1), 1e-300)
        blocks = self._blocks(self.products - mean[:, None] * self.energy)
        return _turning(np.diff(blocks, axis=0)) / math.sqrt(1.5)

    @staticmethod
    def _blocks(products: ComplexArray) -> ComplexArray:
        """(P, N / BLOCK) sums over so many samples."""
        num_ramps, num_samples = products.shape
        whole = products[:, : num_samples // BLOCK * BLOCK].reshape(num_ramps, -1, BLOCK)
        return np.asarray(whole.sum(axis=2))

    def _fitted_prior(self) -> PhasePrior:
        """Prior whose autocovariance is nearest to the estimated one."""
        num_ramps, num_samples = self.products.shape
        lags = np.arange(1, num_samples // 2)
        # -Re v v' = Im v Im v' - Re v Re v'
        spectra = [
            np.abs(fft.fft(part, 2 * num_samples, axis=1)) ** 2
            for part in (self.products.imag, self.products.real, self.energy)
        ]
        sums = [fft.ifft(spectrum.sum(axis=0)).real[lags] for spectrum in spectra]
        weights = np.maximum(sums[2], 1e-300)
        covariance = (sums[0] - sums[1]) / weights
        best, cost = PhasePrior(), math.inf
        for cells in np.geomspace(NARROWEST, num_samples / 4.0, NUM_WIDTHS):
            width = float(cells / num_samples)
            decays = np.exp(-2.0 * np.pi * width * lags)
            jitter, noise = _two_terms(covariance, decays, weights)
            mean_variance = PhasePrior(noise_std=1.0, half_width=width).mean_variance(num_samples)
            uncertain = math.sqrt(2.0 / num_ramps) * max(noise, 0.0) * mean_variance
            if jitter < CERTAIN_JITTER * uncertain or jitter < 0.0:
                jitter, noise = 0.0, _one_term(covariance, decays, weights)
            if noise <= 0.0:
                continue
            left = covariance - jitter - noise * decays
            misfit = float(weights @ left**2)
            if misfit < cost:
                cost = misfit
                # Objects have taken mean and trend of the constants.
                constant = math.sqrt(jitter * num_ramps / (num_ramps - 2))
                best = PhasePrior(jitter_std=constant, noise_std=math.sqrt(noise), half_width=width)
        return best

    def _num_effective(self, prior: PhasePrior) -> float:
        """Effective number of phases: the sum of the shares by which data tell of them."""
        num_ramps, num_samples = self.products.shape
        precision = 2.0 * self.noise_precision * float(self.energy.mean())
        beats = np.asarray(np.fft.fftfreq(num_samples), np.float64)
        told = prior.spectrum(beats, num_samples) * precision
        return float(num_ramps * np.sum(told / (1.0 + told)))

    def _probable(self, prior: PhasePrior) -> FloatArray:
        """(P, N) posterior mean of theta."""
        energy = np.maximum(self.energy, 1e-9 * self.energy.max())
        precision = 2.0 * self.noise_precision * energy
        noisy = self.products.imag / energy
        solve = _MarkovPosterior(precision, prior).mean
        if prior.jitter_std == 0.0:
            return solve(noisy)
        # the constants first, with the process as part of the noise: S^-1 = D - D (D + Q)^-1 D
        ones = np.ones_like(noisy)
        left, own = noisy - solve(noisy), ones - solve(ones)
        information = (precision * own).sum(axis=1) + 1.0 / prior.jitter_std**2
        constant = ((precision * left).sum(axis=1) / information)[:, None]
        return np.asarray(constant + solve(noisy - constant))


class _MarkovPosterior:
    """Posterior of the process within ramps, by the three diagonals of its precision."""

    def __init__(self, precision: FloatArray, prior: PhasePrior) -> None:
        decay = prior.decay
        scale = 1.0 / (prior.noise_std**2 * max(1.0 - decay**2, 1e-12))
        diagonal = precision + scale * (1.0 + decay**2)
        diagonal[:, [0, -1]] -= scale * decay**2
        beside = np.full(precision.shape, -scale * decay)
        beside[:, 0] = 0.0  # ramps are independent
        self._banded = np.stack([beside.ravel(), diagonal.ravel()])
        self._precision = precision

    def mean(self, noisy: FloatArray) -> FloatArray:
        """(P, N) mean given phases that are known with the precision."""
        weighted = (self._precision * noisy).ravel()
        solved = solveh_banded(self._banded, weighted, check_finite=False)
        return np.asarray(solved.reshape(noisy.shape))


def _turning(values: ComplexArray) -> float:
    """Excess of the imaginary parts over the real ones, standard normal where there is none."""
    squares = values * values
    magnitude = math.sqrt(0.5 * float(np.vdot(squares, squares).real))
    return -float(squares.real.sum()) / max(magnitude, 1e-300)


def _without_lines(phases: FloatArray, prior: PhasePrior) -> FloatArray:
    """Phases without lines that stand out of their spectrum over ramps and samples.

    From ramp to ramp they are independent: a line is an object beside a strong one that is not, or
    not fully, modelled yet.
    """
    num_ramps, num_samples = phases.shape
    grid = 2 * num_ramps, 2 * num_samples
    beats = np.asarray(np.fft.fftfreq(grid[1]), np.float64)
    expected = num_ramps * num_samples * prior.spectrum(beats, num_samples)
    for _ in range(MOST_LINES):
        spectrum = fft.fft2(phases, grid)
        ratio = np.abs(spectrum) ** 2 / expected
        ratio[[-1, 0, 1], :3] = 0.0  # what is nearly constant over the frame
        ratio[[-1, 0, 1], -2:] = 0.0
        place = divmod(int(np.argmax(ratio)), grid[1])
        if ratio[place] < LINE:
            break
        power = np.log(np.maximum(np.abs(spectrum) ** 2, 1e-300))
        along = power[:, place[1]], power[place[0]]
        factors = [
            np.exp(2j * np.pi * (index + _vertex(row, index)) * np.arange(size) / (2 * size))
            for row, index, size in zip(along, place, phases.shape, strict=True)
        ]
        line = factors[0][:, None] * factors[1]
        basis = np.stack([line.real.ravel(), line.imag.ravel()], axis=1)
        fitted = basis @ np.linalg.lstsq(basis, phases.ravel(), rcond=None)[0]
        phases = phases - fitted.reshape(phases.shape)
    return phases


def _vertex(row: FloatArray, index: int) -> float:
    """Place of the vertex of the parabola through a peak and its neighbours, from the peak."""
    left, peak, right = row[index - 1], row[index], row[(index + 1) % len(row)]
    return float(0.5 * (left - right) / min(left - 2.0 * peak + right, -1e-12))


def _two_terms(
    covariance: FloatArray, decays: FloatArray, weights: FloatArray
) -> tuple[float, float]:
    """Weights of a constant and a decay, by weighted least squares."""
    ones, mixed, both = weights.sum(), weights @ decays, weights @ decays**2
    first, second = weights @ covariance, weights @ (decays * covariance)
    determinant = max(float(ones * both - mixed**2), 1e-300)
    return (
        float(both * first - mixed * second) / determinant,
        float(ones * second - mixed * first) / determinant,
    )


def _one_term(covariance: FloatArray, decays: FloatArray, weights: FloatArray) -> float:
    return float(weights @ (decays * covariance) / (weights @ decays**2))


def _without_trend(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Values of the ramps without their weighted mean and linear trend."""
    mass = weights.sum()
    ramps = np.arange(len(values)) - weights @ np.arange(len(values)) / mass
    centred = values - weights @ values / mass
    moment = weights @ ramps**2
    return np.asarray(centred - ramps * (weights @ (ramps * centred)) / moment)


def _prior_variance(phases: FloatArray, variances: FloatArray) -> float:
    """Most likely variance of the prior of phases that are known with these variances."""
    prior = max(float(np.mean(phases**2 - variances)), float(np.mean(variances)) * 1e-2)
    for _ in range(PRIOR_STEPS):
        share = prior / (prior + variances)
        # expectation-maximisation: the mean of phi_p^2 under its posterior
        prior = float(np.mean((share * phases) ** 2 + share * variances))
    return prior * len(phases) / (len(phases) - 2)


@lru_cache(maxsize=64)
def _limits(free: int, rate: float) -> tuple[float, float]:
    """Limits of the chi-square and of the F statistic with so many degrees of freedom."""
    # Of chi square and of F; `scipy.stats` takes a quarter of a second to load.
    return float(special.chdtri(free, rate)), float(special.fdtri(free, free, 1.0 - rate))
