"""Complex arrays as two real ones, and inner products with a line over them.

Loops over interleaved real and imaginary parts hardly use vector registers; over parts that lie
apart they do. The kernels of the objects split what they are given once and keep it split.
"""

from typing import NamedTuple

import numpy as np

from vsep._arrays import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled


class Split(NamedTuple):
    """Real and imaginary part of an array."""

    real: FloatArray
    imag: FloatArray


@compiled
def split(array: ComplexArray) -> Split:
    """Take an array apart."""
    return Split(array.real.copy(), array.imag.copy())


@compiled
def row_of(parts: Split, row: int) -> Split:
    """One row of a matrix."""
    return Split(parts.real[row], parts.imag[row])


@compiled
def line_products(signals: Split, line: Split) -> Split:
    """(R,) inner products ``line^H signal`` of a line (M,) with every signal (R, M)."""
    count = len(signals.real)
    products = Split(np.empty(count), np.empty(count))
    c, d = line.real, line.imag
    for row in range(count):
        a, b = signals.real[row], signals.imag[row]
        real = imag = 0.0
        for m in range(len(c)):
            real += a[m] * c[m] + b[m] * d[m]
            imag += b[m] * c[m] - a[m] * d[m]
        products.real[row], products.imag[row] = real, imag
    return products


@compiled
def line_moments(signals: Split, line: Split) -> Split:
    """(3, R) inner products as `line_products`, with two derivatives by the line's frequency.

    A derivative multiplies the line by ``-j 2 pi m``, m counted from its middle.
    """
    count = len(signals.real)
    moments = Split(np.empty((3, count)), np.empty((3, count)))
    c, d = line.real, line.imag
    middle, angular = 0.5 * (len(c) - 1), 2.0 * np.pi
    for row in range(count):
        a, b = signals.real[row], signals.imag[row]
        zeroth_real = zeroth_imag = first_real = first_imag = second_real = second_imag = 0.0
        for m in range(len(c)):
            real = a[m] * c[m] + b[m] * d[m]
            imag = b[m] * c[m] - a[m] * d[m]
            offset = m - middle
            zeroth_real += real
            zeroth_imag += imag
            first_real += offset * real
            first_imag += offset * imag
            second_real += offset * offset * real
            second_imag += offset * offset * imag
        moments.real[0, row], moments.imag[0, row] = zeroth_real, zeroth_imag
        moments.real[1, row], moments.imag[1, row] = -angular * first_imag, angular * first_real
        moments.real[2, row] = -angular * angular * second_real
        moments.imag[2, row] = -angular * angular * second_imag
    return moments
