"""Cache of the last burst search, valid while little has changed in a ramp.

The score of a chirp is the squared length of a projection. Where the residual of a ramp has since
changed by d, no chirp scores more than ``(sqrt(score) + ||d||)^2``: mostly a ramp that held nothing
need not be searched again.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray, IntArray, frozen
from vsep.inference.core.row_energies import row_energies


@dataclass(frozen=True, slots=True, eq=False)
class SearchCache:
    """Rests of P ramps when they were last searched, and what the best chirp in them scores.

    Parameters
    ----------
    residuals : (P, N) or, of several antennas, (A, P, N) complex
        What the model left of the ramps.
    limits : (P,) float
        What no chirp exceeded, summed over the antennas; infinite where nobody looked.
    """

    residuals: ComplexArray
    limits: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        object.__setattr__(self, "residuals", frozen(self.residuals))
        object.__setattr__(self, "limits", frozen(self.limits))

    def limits_of(self, residuals: ComplexArray) -> FloatArray:
        """(P,) what no chirp of other residuals exceeds.

        Examples
        --------
        >>> seen = SearchCache(np.zeros((1, 2), dtype=complex), np.array([9.0]))
        >>> float(seen.limits_of(np.array([[0.0, 4.0j]]))[0])
        49.0
        """
        change = np.sqrt(row_energies(residuals - self.residuals))  # ||d||
        return np.asarray((np.sqrt(self.limits) + change) ** 2)  # (sqrt(score) + ||d||)^2

    def searched(
        self, ramps: IntArray, residuals: ComplexArray, limits: FloatArray
    ) -> "SearchCache":
        """Return what is known after some of the ramps were searched; `limits` are of these."""
        all_residuals, all_limits = self.residuals.copy(), self.limits.copy()
        all_residuals[..., ramps, :] = residuals[..., ramps, :]
        all_limits[ramps] = limits
        return SearchCache(all_residuals, all_limits)


def empty_search_cache(residuals: ComplexArray) -> SearchCache:
    """Return what is known before the first search of residuals (P, N) or (A, P, N)."""
    return SearchCache(residuals.copy(), np.full(residuals.shape[-2], np.inf))
