"""Interference channel of one ramp: line spectra on a grid, multiplied by burst templates.

A column of a ramp is ``template * psi_k``: the template of one of its bursts and an atom of the
grid. All columns of a ramp share one posterior, for bursts that cross each other correlate.
"""

from functools import lru_cache

import numpy as np
from scipy import fft

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.kernels.channel_products import fill_product_rows


class ChannelGrid:
    """Line spectra on the channel grid of one ramp: ``psi_k = exp(-j 2 pi k n / K) / sqrt(N)``."""

    def __init__(self, num_samples: int, num_bins: int) -> None:
        self.num_samples = num_samples
        self.num_bins = num_bins
        # Left writable, as kernels have one machine code for such arrays.
        self.twiddle: ComplexArray = np.exp(-2j * np.pi * np.arange(num_bins) / num_bins)
        self.twiddle /= np.sqrt(num_samples)
        self.scale = float(num_bins / np.sqrt(num_samples))

    def atoms(self, bins: IntArray) -> ComplexArray:
        """(K, N) atoms Psi of some bins, one a row."""
        places = bins[:, None] * np.arange(self.num_samples) % self.num_bins
        return np.asarray(self.twiddle[places])

    def products(self, templates: ComplexArray, residual: ComplexArray) -> ComplexArray:
        """Inner products of all possible columns of a ramp, by one FFT each.

        Parameters
        ----------
        templates : (B, N) complex
            Templates of the ramp's bursts.
        residual : (N,) complex
            Received ramp minus the object estimate.

        Returns
        -------
        (B, B + 1, M) complex
            Entry (i, j, k) for columns of bursts i and j whose bins differ by k; entry (i, B, k)
            for the column of burst i in bin k and the residual.
        """
        count, num_samples = templates.shape
        rows = np.empty((count * (count + 1), num_samples), dtype=np.complex128)
        fill_product_rows(templates, residual, self.scale, rows)
        products = fft.ifft(rows, self.num_bins, axis=1, overwrite_x=True)
        return np.asarray(products.reshape(count, count + 1, self.num_bins))


@lru_cache(maxsize=16)
def channel_grid(num_samples: int, num_bins: int) -> ChannelGrid:
    """Return the grid of a size; the same for all frames."""
    return ChannelGrid(num_samples, num_bins)


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
    weighted = covariance @ correlations  # C A^H c
    explained = np.einsum("ik,ik->k", correlations.conj(), weighted).real  # c^H A C A^H c
    inverse_rho = noise_precision * energy - noise_precision**2 * explained  # (23)
    innovation = projections - correlations.conj().T @ amplitudes  # c^H (r - A mean)
    usable = inverse_rho > 1e-9 * noise_precision * energy
    power = np.abs(noise_precision * innovation) ** 2  # (24): (omega / rho)^2
    ratio = np.where(usable, power / np.where(usable, inverse_rho, 1.0), 0.0)
    return ratio, inverse_rho
