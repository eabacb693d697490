"""Object atoms (10): unit-norm two-dimensional complex exponentials and products with them.

An atom is a Kronecker product, so it is kept as its two factors: nothing of size PN x L is made.
"""

import numpy as np

from vsep._arrays import ComplexArray, FloatArray


def line_factors(frequencies: FloatArray, length: int) -> ComplexArray:
    """Unit-norm exponentials ``exp(-j 2 pi f m) / sqrt(length)``, one row a frequency.

    Parameters
    ----------
    frequencies : (L,) float
        Normalised frequencies, cycles per step.
    length : int
        Number of steps M.

    Returns
    -------
    (L, M) complex

    Examples
    --------
    >>> import numpy as np
    >>> np.round(line_factors(np.array([0.25]), 4) * 2)
    array([[ 1.+0.j,  0.-1.j, -1.-0.j, -0.+1.j]])
    """
    phase = np.outer(frequencies, np.arange(length))
    return np.asarray(np.exp(-2j * np.pi * phase) / np.sqrt(length))


def synthesize(
    amplitudes: ComplexArray, beat_factors: ComplexArray, doppler_factors: ComplexArray
) -> ComplexArray:
    """Object signal Phi alpha as a (P, N) array from (L, N) and (L, P) factors."""
    return np.asarray((doppler_factors * amplitudes[:, None]).T @ beat_factors)


def project(
    signal: ComplexArray, beat_factors: ComplexArray, doppler_factors: ComplexArray
) -> ComplexArray:
    """Adjoint Phi^H r: (L,) inner products of a (P, N) signal with every atom."""
    along_ramps = signal @ beat_factors.conj().T
    return np.asarray(np.einsum("lp,pl->l", doppler_factors.conj(), along_ramps))


def gram(beat_factors: ComplexArray, doppler_factors: ComplexArray) -> ComplexArray:
    """Gram matrix Phi^H Phi, (L, L): the product of two Dirichlet kernels."""
    return np.asarray(
        (beat_factors.conj() @ beat_factors.T) * (doppler_factors.conj() @ doppler_factors.T)
    )
