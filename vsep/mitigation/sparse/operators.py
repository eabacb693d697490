"""Sensing operator from a range-Doppler spectrum to the clean samples, in two forms.

The spectrum X of a frame Y is Y = W X in the paper's sign: synthesis is the unitary *forward* DFT
in both dimensions, its adjoint the unitary inverse DFT. A keeps of W X the samples that are clean:

- `MaskedFft`: W by a two-dimensional FFT, the mask sets the other samples to zero ("2-D masked
  residual updates", (17)). Spectrum and samples are (P, N) arrays.
- `ExplicitMatrix`: the rows of the Kronecker product of both DFT matrices that belong to clean
  samples, (11), as one matrix. Spectrum and samples are vectors of PN and q elements.

Solvers use nothing but this interface, so the two give the same iterates up to rounding. The rows
of A are orthonormal: ``A A^H`` is the identity on the clean samples, and the norm of A is one.
That W is a DFT holds for equal ramps; of dithered ones it is a `DitheredTransform`.
"""

from typing import Any, Literal, Protocol, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft2, ifft2
from scipy.linalg import dft

from vsep._typing import BoolArray, ComplexArray, IntArray, frozen
from vsep._validation import require_choice
from vsep.errors import InputError
from vsep.signal.dithered_atoms import RampDither
from vsep.signal.dithered_spectra import DitheredTransform, dithered_transform

# Single or double precision; what comes out is of the precision that went in.
Samples: TypeAlias = NDArray[np.complexfloating[Any, Any]]
RealSamples: TypeAlias = NDArray[np.floating[Any]]
Domain: TypeAlias = Literal["masked-2d", "explicit-1d"]
DOMAINS: tuple[Domain, ...] = get_args(Domain)
_MAX_MATRIX = 2**26  # elements: a frame of 128 x 64 just fits (1 GB in double precision)


class SensingOperator(Protocol):
    """What solvers know of the measurement."""

    @property
    def num_measurements(self) -> int:
        """q, the number of clean samples."""

    @property
    def num_cells(self) -> int:
        """P times N, the number of cells of the spectrum."""

    def measured(self, frame: Samples) -> Samples:
        """Clean samples of a (P, N) frame, in the operator's form."""

    def forward(self, spectrum: Samples) -> Samples:
        """Return A x: the clean samples of the frame that a spectrum synthesises."""

    def synthesis(self, spectrum: Samples) -> Samples:
        """Return W x: the whole frame (P, N) that a spectrum synthesises."""

    def adjoint(self, samples: Samples) -> Samples:
        """Return A^H y: the spectrum of clean samples, the others being zero."""

    def adjoint_of_scratch(self, samples: Samples) -> Samples:
        """Return A^H y as `adjoint` does; the samples may be overwritten."""

    def inner_products(self, cells: IntArray, others: IntArray) -> ComplexArray:
        """(K, M) inner products of columns of A; cells count along the stacked spectrum."""

    def from_map(self, values: RealSamples) -> RealSamples:
        """Bring a (P, N) array of cells into the operator's form."""

    def to_map(self, spectrum: Samples) -> Samples:
        """(P, N) spectrum, whatever the operator's form."""


class MaskedFft:
    """A by two-dimensional FFTs; the mask sets interfered samples to zero, (17).

    Parameters
    ----------
    interfered : (P, N) bool
        True where a sample is interfered.
    precision : dtype
        complex64 or complex128.
    dither : RampDither, optional
        How ramps were dithered.

    Examples
    --------
    >>> import numpy as np
    >>> operator = MaskedFft(np.eye(4, dtype=bool), np.complex64)
    >>> spectrum = np.ones((4, 4), dtype=np.complex64)
    >>> operator.forward(spectrum)[0]
    array([0.+0.j, 0.+0.j, 0.+0.j, 0.+0.j], dtype=complex64)
    >>> operator.num_measurements
    12
    """

    def __init__(
        self, interfered: BoolArray, precision: Any, dither: RampDither | None = None
    ) -> None:
        real = np.zeros(0, dtype=precision).real.dtype
        self._clean = frozen(np.asarray(~interfered, dtype=real))
        self._precision = np.dtype(precision)
        self.num_measurements = int(np.count_nonzero(~interfered))
        self.num_cells = interfered.size
        self._dithered: DitheredTransform | None = None
        if dither is not None:
            self._dithered = dithered_transform(dither, interfered.shape[1], precision)

    def measured(self, frame: Samples) -> Samples:
        """(P, N) frame with its interfered samples set to zero, whatever they held."""
        return np.where(self._clean > 0.0, frame, 0.0).astype(self._precision, copy=False)

    def forward(self, spectrum: Samples) -> Samples:
        """(P, N) samples of a (P, N) spectrum, zero where interfered."""
        samples: Samples = self.synthesis(spectrum)
        samples *= self._clean
        return samples

    def synthesis(self, spectrum: Samples) -> Samples:
        """(P, N) frame W x of a spectrum, gaps included."""
        if self._dithered is not None:
            return self._dithered.synthesis(spectrum)
        frame: Samples = fft2(spectrum, norm="ortho")
        return frame

    def adjoint(self, samples: Samples) -> Samples:
        """(P, N) spectrum of (P, N) samples that are zero where interfered."""
        if self._dithered is not None:
            return self._dithered.analysis(samples)
        spectrum: Samples = ifft2(samples, norm="ortho")
        return spectrum

    def adjoint_of_scratch(self, samples: Samples) -> Samples:
        """(P, N) spectrum of (P, N) samples, in their own memory."""
        if self._dithered is not None:
            return self._dithered.analysis(samples)
        spectrum: Samples = ifft2(samples, norm="ortho", overwrite_x=True)
        return spectrum

    def inner_products(self, cells: IntArray, others: IntArray) -> ComplexArray:
        """(K, M) inner products of columns: the spectrum of the mask at their differences."""
        if self._dithered is not None:
            return self._dithered_products(cells, others)
        spectrum: ComplexArray = ifft2(self._clean.astype(np.float64))
        row, column = np.divmod(cells, spectrum.shape[1])
        other_row, other_column = np.divmod(others, spectrum.shape[1])
        # Negative differences count from the end, as the periodic spectrum wants it.
        differences = (other_row - row[:, None], other_column - column[:, None])
        return np.asarray(spectrum[differences].conj())

    def _dithered_products(self, cells: IntArray, others: IntArray) -> ComplexArray:
        """Inner products of columns that do not depend on differences only."""
        products = np.empty((len(cells), len(others)), dtype=np.complex128)
        for number, other in enumerate(others):
            column = np.zeros(self._clean.shape, dtype=self._precision)
            column.flat[other] = 1.0
            products[:, number] = self.adjoint(self.forward(column)).ravel()[cells]
        return products

    def from_map(self, values: RealSamples) -> RealSamples:
        """Return the (P, N) array itself."""
        return values

    def to_map(self, spectrum: Samples) -> Samples:
        """Return the (P, N) spectrum itself."""
        return spectrum


class ExplicitMatrix:
    """A as a (q, PN) matrix on the stacked frame, (11): the reference.

    Arguments are those of `MaskedFft`. Raises `InputError` if the matrix would not fit into memory.
    """

    def __init__(
        self, interfered: BoolArray, precision: Any, dither: RampDither | None = None
    ) -> None:
        num_ramps, num_samples = interfered.shape
        self.num_measurements = int(np.count_nonzero(~interfered))
        self.num_cells = interfered.size
        if self.num_measurements * self.num_cells > _MAX_MATRIX:
            raise InputError(
                f"The frame has {num_ramps} x {num_samples} samples, for which the explicit matrix "
                f"has {self.num_measurements * self.num_cells} elements; it must have at most "
                f"{_MAX_MATRIX}. The domain masked-2d has no such limit."
            )
        self._shape = interfered.shape
        self._kept = frozen(np.flatnonzero(~interfered))
        self._dithered: DitheredTransform | None = None
        if dither is not None:
            self._dithered = dithered_transform(dither, num_samples, precision)
            self._matrix: Samples = self._dithered_rows(precision)
            return
        slow = dft(num_ramps, scale="sqrtn").astype(precision)
        fast = dft(num_samples, scale="sqrtn").astype(precision)
        ramp, sample = np.divmod(self._kept, num_samples)
        # Row (p, n) of the Kronecker product is the product of row p and row n; only kept rows are
        # ever made.
        rows = slow[ramp][:, :, None] * fast[sample][:, None, :]
        rows.flags.writeable = False
        self._matrix = rows.reshape(len(self._kept), -1)

    def _dithered_rows(self, precision: Any) -> Samples:
        """(q, PN) kept samples of the frame of every cell."""
        assert self._dithered is not None
        cells = np.eye(self.num_cells, dtype=precision).reshape(-1, *self._shape)
        columns = [self._dithered.synthesis(cell).ravel()[self._kept] for cell in cells]
        return frozen(np.stack(columns, axis=1))

    def synthesis(self, spectrum: Samples) -> Samples:
        """(P, N) frame W x of a spectrum, gaps included."""
        if self._dithered is not None:
            return self._dithered.synthesis(self.to_map(spectrum))
        frame: Samples = fft2(self.to_map(spectrum), norm="ortho")
        return frame

    def measured(self, frame: Samples) -> Samples:
        """(q,) clean samples of a (P, N) frame."""
        return frame.ravel()[self._kept].astype(self._matrix.dtype, copy=False)

    def forward(self, spectrum: Samples) -> Samples:
        """(q,) samples of a (PN,) spectrum."""
        return np.asarray(self._matrix @ spectrum)

    def adjoint(self, samples: Samples) -> Samples:
        """(PN,) spectrum of (q,) samples."""
        # (y^H A)^H: conjugating two vectors is cheaper than the matrix.
        return np.asarray((samples.conj() @ self._matrix).conj())

    def adjoint_of_scratch(self, samples: Samples) -> Samples:
        """(PN,) spectrum of (q,) samples."""
        return self.adjoint(samples)

    def inner_products(self, cells: IntArray, others: IntArray) -> ComplexArray:
        """(K, M) inner products of columns."""
        products = self._matrix[:, cells].conj().T @ self._matrix[:, others]
        return np.asarray(products, dtype=np.complex128)

    def from_map(self, values: RealSamples) -> RealSamples:
        """(PN,) stacked form of a (P, N) array."""
        return values.ravel()

    def to_map(self, spectrum: Samples) -> Samples:
        """(P, N) form of a (PN,) spectrum."""
        return spectrum.reshape(self._shape)


def make_operator(
    domain: str, interfered: BoolArray, precision: Any, dither: RampDither | None = None
) -> SensingOperator:
    """Return the operator of a mask.

    `domain`: one of `DOMAINS`; `interfered` (P, N): True where a sample is interfered; `precision`:
    complex64 or complex128; `dither`: how ramps were dithered. Raises `InputError` if the domain is
    unknown or the explicit matrix would not fit.
    """
    require_choice("The domain", domain, DOMAINS)
    if domain == "masked-2d":
        return MaskedFft(interfered, precision, dither)
    return ExplicitMatrix(interfered, precision, dither)
