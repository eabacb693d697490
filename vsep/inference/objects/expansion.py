"""Expansion of a frame around known places of objects.

Inner products of an atom with a frame and with other atoms are, within a fraction of a resolution
cell, polynomials of second degree of how far it has moved. The phase of an atom stands still in the
middle of the frame, so that the Gram matrix is real; what the expansion leaves out is of third
degree in the move, whose first term vanishes for a lone atom.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.kernels.line_spectra import BEAT_ORDERS, DOPPLER_ORDERS
from vsep.signal.atoms import half_line_jets, half_lines, line_factors


@dataclass(frozen=True, slots=True, eq=False)
class Expansion:
    """Second-order expansion of K atoms' inner products around their places.

    Parameters
    ----------
    products : (6, K, A) complex
        With what A antennas received: values, first (b, d) and second derivatives (bb, bd, dd).
    grams : (6, K, K) float
        With each other, derivatives by the first atom's frequencies.
    """

    products: ComplexArray
    grams: FloatArray

    def chosen(self, kept: BoolArray) -> "Expansion":
        """Return that of some of the atoms."""
        return Expansion(self.products[:, kept], self.grams[:, kept][:, :, kept])


def expanded(points: FloatArray, frame: ComplexArray, num_antennas: int) -> Expansion:
    """Expand a frame (A P, N) around points (K, 2).

    Examples
    --------
    One atom in a frame that is this atom: its product is one and has no slope.

    >>> from vsep.signal.atoms import dense_atoms
    >>> places = np.array([[0.1, 0.2]])
    >>> around = expanded(places, dense_atoms(*places.T, (4, 16))[0], 1)
    >>> float(np.round(abs(around.products[0, 0, 0]), 12)), float(around.grams[0, 0, 0].round(12))
    (1.0, 1.0)
    >>> bool(np.all(np.abs(around.products[1:3]) < 1e-9))
    True
    """
    count, (num_rows, num_samples) = len(points), frame.shape
    num_ramps = num_rows // num_antennas
    beat, doppler = half_lines(points[:, 0], num_samples), half_lines(points[:, 1], num_ramps)
    along = _along_samples(frame, beat).reshape(3, count, num_antennas, num_ramps)
    rows = along.transpose(1, 0, 2, 3).reshape(count, 3 * num_antennas, num_ramps)
    whole = (rows @ _conjugate_derivatives(points[:, 1], num_ramps)).reshape(
        count, 3, num_antennas, 3
    )
    products = whole[:, [*BEAT_ORDERS], :, [*DOPPLER_ORDERS]]
    return Expansion(products, half_line_jets(beat, doppler, (num_ramps, num_samples)))


def _along_samples(frame: ComplexArray, lines: FloatArray) -> ComplexArray:
    """(3, K, A P) inner products of lines with rows, and derivatives by the lines' frequency."""
    half, count = lines.shape[3], lines.shape[2]
    right, left = frame[:, frame.shape[1] - half :], frame[:, half - 1 :: -1]
    total, difference = right + left, right - left
    # of x^k (cos + j sin) what is even, and what is odd
    straight, turned = lines.reshape(2, 3 * count, half)
    first = _real_product(straight, total).reshape(3, count, len(frame))
    second = _real_product(turned, difference).reshape(3, count, len(frame))
    along = first + 1j * second
    # The derivative of order k has the factor j^k.
    along[1] = 1j * second[1] - first[1]
    along[2] *= -1.0
    return along


def _real_product(lines: FloatArray, rows: ComplexArray) -> ComplexArray:
    """Lines (K, M) times rows (R, M), (K, R): real numbers by complex ones."""
    parts = np.concatenate([rows.real, rows.imag])
    both = lines @ parts.T
    products = np.empty((len(lines), len(rows)), dtype=np.complex128)
    products.real, products.imag = both[:, : len(rows)], both[:, len(rows) :]
    return products


def _conjugate_derivatives(frequencies: FloatArray, length: int) -> ComplexArray:
    """(K, M, 3) conjugate lines, at rest in their middle, and their derivatives."""
    middle = 0.5 * (length - 1)
    lines = line_factors(frequencies, length).conj()
    lines *= np.exp(-2j * np.pi * middle * frequencies)[:, None]
    course = 2j * np.pi * (np.arange(length) - middle)
    return np.stack([lines, course * lines, course * course * lines], axis=2)
