"""Complex arrays as separate real and imaginary parts, and products of them.

Loops over interleaved real and imaginary parts hardly use vector registers; over parts that lie
apart they do. Kernels split what they are given once and keep it split.
"""

from typing import NamedTuple

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.kernels.compiler import compiled


class ComplexParts(NamedTuple):
    """Real and imaginary part of an array."""

    real: FloatArray
    imag: FloatArray


@compiled
def row_of(parts: ComplexParts, row: int) -> ComplexParts:
    """One row of a matrix."""
    return ComplexParts(parts.real[row], parts.imag[row])


@compiled
def rows_to(parts: ComplexParts, end: int) -> ComplexParts:
    """Rows of a matrix up to one of them."""
    return ComplexParts(parts.real[:end], parts.imag[:end])


@compiled
def empty_row(size: int) -> ComplexParts:
    """(M,) values to be written, in one piece of memory."""
    parts = np.empty((2, size))
    return ComplexParts(parts[0], parts[1])


@compiled
def empty_rows(num_rows: int, size: int) -> ComplexParts:
    """(R, M) values to be written, in one piece of memory."""
    parts = np.empty((2, num_rows, size))
    return ComplexParts(parts[0], parts[1])


@compiled
def split(array: ComplexArray) -> ComplexParts:
    """Take a matrix apart."""
    num_rows, size = array.shape
    parts = empty_rows(num_rows, size)
    for row in range(num_rows):
        for m in range(size):
            parts.real[row, m], parts.imag[row, m] = array[row, m].real, array[row, m].imag
    return parts


@compiled
def split_row(row: ComplexArray) -> ComplexParts:
    """Take one complex row (M,) apart, as a matrix (1, M)."""
    parts = empty_rows(1, len(row))
    for m in range(len(row)):
        parts.real[0, m], parts.imag[0, m] = row[m].real, row[m].imag
    return parts


@compiled
def write_row(line: ComplexParts, rows: ComplexParts, row: int) -> None:
    """Write a line (M,) into a row of a matrix (R, M)."""
    for m in range(len(line.real)):
        rows.real[row, m], rows.imag[row, m] = line.real[m], line.imag[m]


@compiled
def multiply(
    first: ComplexParts, i: int, second: ComplexParts, j: int, products: ComplexParts, row: int
) -> None:
    """Write the product of row i of a matrix and row j of another into a row of a third."""
    for k in range(products.real.shape[1]):
        # (a + j b) (c + j d)
        a, b = first.real[i, k], first.imag[i, k]
        c, d = second.real[j, k], second.imag[j, k]
        products.real[row, k], products.imag[row, k] = a * c - b * d, a * d + b * c


@compiled
def inner(a: ComplexParts, i: int, b: ComplexParts, j: int) -> complex:
    """Inner product of row i of a with row j of b."""
    a_real, a_imag, b_real, b_imag = a.real[i], a.imag[i], b.real[j], b.imag[j]
    real = imag = 0.0
    for n in range(len(a_real)):
        real += a_real[n] * b_real[n] + a_imag[n] * b_imag[n]  # Re a^* b
        imag += a_real[n] * b_imag[n] - a_imag[n] * b_real[n]  # Im a^* b
    return complex(real, imag)


@compiled
def add_scaled(weight: complex, source: ComplexParts, i: int, target: ComplexParts, j: int) -> None:
    """Add a weight times row i of the source to row j of the target."""
    real, imag = weight.real, weight.imag
    a, b = source.real[i], source.imag[i]
    c, d = target.real[j], target.imag[j]
    for n in range(len(a)):
        c[n] += real * a[n] - imag * b[n]  # Re of weight times source
        d[n] += real * b[n] + imag * a[n]  # Im


@compiled
def line_products(signals: ComplexParts, line: ComplexParts, products: ComplexParts) -> None:
    """Write inner products ``line^H signal`` of a line (M,) with signals (R, M) into the first row.

    Of ``products``, (1, R) at least.
    """
    a, b = signals
    c, d = line
    for row in range(len(a)):
        real = imag = 0.0
        for m in range(len(c)):
            real += a[row, m] * c[m] + b[row, m] * d[m]  # Re of line^* signal
            imag += b[row, m] * c[m] - a[row, m] * d[m]
        products.real[0, row], products.imag[0, row] = real, imag


@compiled
def line_moments(signals: ComplexParts, line: ComplexParts, moments: ComplexParts) -> None:
    """Write (3, R) `line_products` with their first two derivatives by the line's frequency.

    A derivative multiplies the line by ``-j 2 pi m``, m counted from its middle.
    """
    a, b = signals
    c, d = line
    angular = 2.0 * np.pi
    for row in range(len(a)):
        zeroth_real = zeroth_imag = first_real = first_imag = second_real = second_imag = 0.0
        # From the middle, first and second derivatives are least correlated with the value.
        offset = -0.5 * (len(c) - 1)
        for m in range(len(c)):
            real = a[row, m] * c[m] + b[row, m] * d[m]
            imag = b[row, m] * c[m] - a[row, m] * d[m]
            # sum of line^* signal
            zeroth_real += real
            zeroth_imag += imag
            # sum of m line^* signal
            first_real += offset * real
            first_imag += offset * imag
            # sum of m^2 line^* signal
            second_real += offset * offset * real
            second_imag += offset * offset * imag
            offset += 1.0  # counted, not converted from m, which would keep the loop scalar
        # The conjugate line has the derivatives (+j 2 pi m)^k.
        moments.real[0, row], moments.imag[0, row] = zeroth_real, zeroth_imag
        moments.real[1, row], moments.imag[1, row] = -angular * first_imag, angular * first_real
        moments.real[2, row] = -angular * angular * second_real
        moments.imag[2, row] = -angular * angular * second_imag
