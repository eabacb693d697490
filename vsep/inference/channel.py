"""The interference channel of one ramp: line spectra on a fixed grid, seen through its bursts.

A column of a ramp is ``template * psi_k``: the template of one of its bursts and an atom of the
grid. All columns of a ramp share one posterior, for bursts that cross each other correlate.
"""

import numpy as np
from scipy import fft

from vsep._arrays import ComplexArray, FloatArray, IntArray
from vsep.inference.sbl import ActiveSet


class ChannelGrid:
    """Line spectra on the channel grid of one ramp: ``psi_k = exp(-j 2 pi k n / K) / sqrt(N)``."""

    def __init__(self, num_samples: int, num_bins: int) -> None:
        self.num_samples = num_samples
        self.num_bins = num_bins

    def atoms(self, bins: IntArray) -> ComplexArray:
        """(N, K) active columns of Psi."""
        turns = np.outer(np.arange(self.num_samples), bins) % self.num_bins
        twiddle = np.exp(-2j * np.pi * np.arange(self.num_bins) / self.num_bins)
        return np.asarray(twiddle[turns] / np.sqrt(self.num_samples))

    def gram_lags(self, first: ComplexArray, second: ComplexArray) -> ComplexArray:
        """Gram entry of two columns by their bin difference, one FFT for templates (..., N)."""
        lags = fft.ifft(first.conj() * second, self.num_bins)
        return np.asarray(lags * (self.num_bins / self.num_samples))

    def projections(self, templates: ComplexArray, residual: ComplexArray) -> ComplexArray:
        """(U Psi)^H r of every bin of the grid, one FFT a template (..., N)."""
        spectrum = fft.ifft(templates.conj() * residual, self.num_bins)
        return np.asarray(spectrum * (self.num_bins / np.sqrt(self.num_samples)))


def channel_posterior(
    grid: ChannelGrid,
    templates: ComplexArray,
    residual: ComplexArray,
    owners: IntArray,
    bins: IntArray,
    precisions: FloatArray,
    noise_precision: float,
) -> ActiveSet:
    """Weight posterior (60)-(62) of the columns of one ramp.

    Parameters
    ----------
    grid : ChannelGrid
        The channel grid.
    templates : (B, N) complex
        Templates of the ramp's bursts.
    residual : (N,) complex
        Received ramp minus the object estimate.
    owners, bins, precisions : (K,) arrays
        Burst, bin and prior precision of every column.
    noise_precision : float
        lambda.
    """
    lags = grid.gram_lags(templates[:, None], templates[None, :])
    differences = (bins[:, None] - bins[None, :]) % grid.num_bins
    gram = lags[owners[:, None], owners[None, :], differences]
    projections = grid.projections(templates, residual)[owners, bins]
    return ActiveSet(gram, projections, precisions, noise_precision)


def passive_ratios(
    correlations: ComplexArray,
    projections: ComplexArray,
    energy: float | FloatArray,
    covariance: ComplexArray,
    amplitudes: ComplexArray,
    noise_precision: float,
) -> tuple[FloatArray, FloatArray]:
    """(23)-(24) of every bin of the grid at once.

    Parameters
    ----------
    correlations : (K, B) complex
        Inner products of the K active columns with the B candidates.
    projections : (B,) complex
        Inner products of the candidates with the residual.
    energy : float or (B,) float
        Squared norms of the candidates.
    covariance, amplitudes : (K, K), (K,) complex
        Posterior of the active columns.
    noise_precision : float
        lambda.

    Returns
    -------
    ratio : (B,) float
        omega^2 / rho; zero where the active columns explain a candidate to rounding.
    inverse_rho : (B,) float
    """
    weighted = covariance @ correlations
    explained = np.einsum("ik,ik->k", correlations.conj(), weighted).real
    inverse_rho = noise_precision * energy - noise_precision**2 * explained
    innovation = projections - correlations.conj().T @ amplitudes
    usable = inverse_rho > 1e-9 * noise_precision * energy
    power = np.abs(noise_precision * innovation) ** 2
    ratio = np.where(usable, power / np.where(usable, inverse_rho, 1.0), 0.0)
    return ratio, inverse_rho
