"""Inner products of all possible columns of a ramp by one FFT a row."""

import numpy as np

from vsep._typing import ComplexArray
from vsep.kernels.channel import Channel
from vsep.kernels.compiler import compiled


@compiled
def fill_product_rows(
    templates: ComplexArray, residual: ComplexArray, scale: float, rows: ComplexArray
) -> None:
    """Write the (B (B + 1), N) rows whose spectra are the inner products of all possible columns.

    Row i (B + 1) + j is for columns of burst i with those of burst j, with the residual if j = B.
    """
    count, num_samples = templates.shape
    between = scale / np.sqrt(num_samples)
    for i in range(count):
        own, place = templates[i], i * (count + 1)
        for j in range(count):
            row, other = rows[place + j], templates[j]
            for n in range(num_samples):
                # conj(U_i) U_j: its spectrum is psi_k^H U_i^H U_j psi_l at k - l
                row[n] = between * (own[n].conjugate() * other[n])
        row = rows[place + count]
        for n in range(num_samples):
            # conj(U_i) r: its spectrum is psi_k^H U_i^H r
            row[n] = scale * (own[n].conjugate() * residual[n])


@compiled
def gathered_products(
    products: ComplexArray, count: int, channel: Channel
) -> tuple[ComplexArray, ComplexArray]:
    """Gram matrix and projections of the columns from the products of all possible ones."""
    owners, bins = channel.owners, channel.bins
    size, num_bins = len(bins), products.shape[1]
    gram = np.empty((size, size), dtype=np.complex128)
    projections = np.empty(size, dtype=np.complex128)
    for i in range(size):
        first = owners[i] * (count + 1)
        projections[i] = products[first + count, bins[i]]
        for j in range(size):
            # psi_k^H U^H U psi_l depends on the bins' difference alone.
            lag = bins[i] - bins[j]
            lag = lag if lag >= 0 else lag + num_bins
            gram[i, j] = products[first + owners[j], lag]
    return gram, projections
