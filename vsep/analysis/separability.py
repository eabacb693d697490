"""Condition (27): energies of the object and interference signals as the object atoms see them.

Two readings. As printed it compares two norms over all objects,

    ||Phi^H Phi alpha||  =  ||Phi^H U Psi beta||,

which the strongest object decides. Read object by object, ``|alpha_l| = |phi_l^H U Psi beta|``,
the weakest one meets it first as the interference grows. In Simulation I, with one object, both
are the same.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep.signal.atoms import line_factors, project
from vsep.units import to_db


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Separability:
    """Both readings of condition (27), in dB; zero is equality, above it the objects dominate."""

    #: ||Phi^H Phi alpha|| over ||Phi^H U Psi beta||; NaN without objects or interference
    whole_db: float
    #: (L,) |alpha_l| over |phi_l^H U Psi beta|, object by object; NaN without interference
    object_db: FloatArray

    @property
    def weakest_db(self) -> float:
        """The smallest of `object_db`; NaN without objects or interference."""
        return float(np.min(self.object_db)) if len(self.object_db) else float("nan")


def separability(
    beats: FloatArray,
    dopplers: FloatArray,
    amplitudes: ComplexArray,
    interference_signal: ComplexArray,
) -> Separability:
    """Evaluate condition (27) for given objects and interference.

    Parameters
    ----------
    beats, dopplers : (L,) float
        Normalised frequencies of the objects.
    amplitudes : (L,) complex
        Weights of unit-norm atoms.
    interference_signal : (P, N) complex
        U Psi beta.

    Returns
    -------
    Separability
        Both ratios fall by one dB per dB of interference.
    """
    num_ramps, num_samples = interference_signal.shape
    factors = line_factors(beats, num_samples), line_factors(dopplers, num_ramps)
    if len(beats) == 0 or not np.any(interference_signal):
        return Separability(whole_db=float("nan"), object_db=np.full(len(beats), np.nan))
    beat_factors, doppler_factors = factors
    object_signal = (doppler_factors * amplitudes[:, None]).T @ beat_factors
    own = project(object_signal, *factors)
    other = project(interference_signal, *factors)
    whole = _energy(own) / _energy(other)
    each = np.abs(amplitudes) ** 2 / np.maximum(np.abs(other) ** 2, 1e-300)
    return Separability(whole_db=float(to_db(whole)), object_db=np.asarray(to_db(each)))


def _energy(values: ComplexArray) -> float:
    return float(np.sum(np.abs(values) ** 2))
