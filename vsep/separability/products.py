"""Inner products of the objects' lines, as far as some cell needs them.

Cells differ in the number of objects (later ones are left out) and in the delay of the first one.
So the others come first, in their order, and the first one comes last, at all its delays: cells
share the products of the others, and no two delays ever meet.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsep._typing import ComplexArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Products:
    """Inner products of the C kinds of columns of F other objects and of a last one at D delays."""

    among: NDArray[Any]  #: (B, C, F, C, F) of the others
    across: NDArray[Any]  #: (B, C, F, C, D) of the others with the last one
    within: NDArray[Any]  #: (B, C, C, D) of the last one with itself

    def summed(self, num_segments: int) -> "Products":
        """Sum over all segments of a burst's ramps up to each; B holds segments fastest."""
        if num_segments == 1:
            return self
        return Products(
            among=_accumulated(self.among, num_segments),
            across=_accumulated(self.across, num_segments),
            within=_accumulated(self.within, num_segments),
        )

    def minus(self, other: "Products") -> "Products":
        """Subtract others; B of 1 serves all."""
        return Products(
            among=self.among - other.among,
            across=self.across - other.across,
            within=self.within - other.within,
        )

    def as_real(self) -> "Products":
        """Products of the real parameters: parts of the weight, then the frequencies.

        The first kind of column, the atom, counts for the real part of the weight and turned by a
        quarter for the imaginary part.
        """
        size = self.within.shape[1] + 1
        among = np.empty((len(self.among), size, self.among.shape[2], size, self.among.shape[4]))
        across = np.empty(
            (len(self.across), size, self.across.shape[2], size, self.across.shape[4])
        )
        within = np.empty((len(self.within), size, size, self.within.shape[3]))
        for i in range(size):
            for j in range(size):
                kinds = max(i - 1, 0), max(j - 1, 0)
                among[:, i, :, j] = _turned(self.among[:, kinds[0], :, kinds[1]], i, j)
                across[:, i, :, j] = _turned(self.across[:, kinds[0], :, kinds[1]], i, j)
                within[:, i, j] = _turned(self.within[:, kinds[0], kinds[1]], i, j)
        return Products(among=among, across=across, within=within)


def make_products(columns: ComplexArray | FloatArray, num_others: int) -> Products:
    """Multiply columns with each other.

    `columns` (B, R, C, U): R coordinates of the C kinds of columns of all lines: the others, then
    the last one; `num_others`: F.
    """
    num_keys, num_rows, num_kinds, _ = columns.shape
    others = columns[..., :num_others].reshape(num_keys, num_rows, -1)
    last = np.ascontiguousarray(columns[..., num_others:])
    left = np.ascontiguousarray(others.conj().swapaxes(1, 2))
    shape = num_keys, num_kinds, num_others, num_kinds
    return Products(
        among=(left @ others).reshape(*shape, num_others),
        across=(left @ last.reshape(num_keys, num_rows, -1)).reshape(*shape, last.shape[3]),
        within=np.einsum("brcd,bred->bced", last.conj(), last),
    )


def _turned(products: ComplexArray, i: int, j: int) -> FloatArray:
    """Real products of parameters; number 1 is a column times the imaginary unit."""
    if (i == 1) == (j == 1):
        return products.real
    return np.asarray(products.imag if i == 1 else -products.imag)


def _accumulated(values: NDArray[Any], num_segments: int) -> NDArray[Any]:
    parts = values.reshape(-1, num_segments, *values.shape[1:])
    return np.cumsum(parts, axis=1).reshape(values.shape)
