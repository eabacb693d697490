"""Accuracy of one frame's estimate: assigned errors, misses, false alarms, SINR and EVM.

The assignment is that of GOSPA. The paper's localisation error is the mean over the assigned pairs
of the Euclidean distance in *normalised frequency* (Sec. IV-C), its "mean assigned RMSE".
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ellipe

from vsep._typing import ComplexArray, FloatArray, IntArray
from vsep.analysis.gospa import DEFAULT_CUTOFF, DEFAULT_ORDER, Gospa, cell_distances, gospa
from vsep.signal.atoms import DispersionStd, line_factors, project
from vsep.signal.scene import GroundTruth
from vsep.units import to_db, wrap_frequency


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FrameErrors:
    """Errors of one frame."""

    gospa: Gospa  #: in resolution cells
    found_indices: IntArray  #: (A,) estimates that were assigned, in the order of their truths
    #: (A,) estimate minus truth, normalised frequency, wrapped
    beat_errors: FloatArray
    doppler_errors: FloatArray
    errors: FloatArray  #: (A,) their Euclidean lengths

    @property
    def misses(self) -> int:
        """Number of truths without an estimate."""
        return self.gospa.num_missed

    @property
    def false_alarms(self) -> int:
        """Number of estimates without a truth."""
        return self.gospa.num_false

    @property
    def mean_assigned_error(self) -> float:
        """Mean of `errors`; NaN if nothing was assigned."""
        return float(np.mean(self.errors)) if len(self.errors) else float("nan")


def frame_errors(
    true: FloatArray,
    found: FloatArray,
    shape: tuple[int, int],
    *,
    cutoff: float = DEFAULT_CUTOFF,
    order: float = DEFAULT_ORDER,
) -> FrameErrors:
    """Compare the estimated lines of one frame with the true ones.

    Parameters
    ----------
    true, found, shape
        As for `cell_distances`; the shape sets the resolution cell.
    cutoff, order : float
        Of GOSPA, the cut-off in resolution cells.

    Examples
    --------
    >>> import numpy as np
    >>> true, found = np.array([[0.1, 0.0]]), np.array([[0.101, 0.0], [0.3, 0.0]])
    >>> errors = frame_errors(true, found, (1, 256))
    >>> errors.misses, errors.false_alarms, round(errors.mean_assigned_error, 6)
    (0, 1, 0.001)
    """
    matched = gospa(cell_distances(true, found, shape), cutoff=cutoff, order=order)
    offsets = wrap_frequency(found[matched.found_indices] - true[matched.true_indices])
    return FrameErrors(
        gospa=matched,
        found_indices=matched.found_indices,
        beat_errors=offsets[:, 0],
        doppler_errors=offsets[:, 1],
        errors=np.asarray(np.hypot(offsets[:, 0], offsets[:, 1])),
    )


def sinr_db(object_signal: ComplexArray, cleaned: ComplexArray) -> float:
    """Signal to interference-plus-noise ratio after cancellation, of total energies, in dB.

    Parameters
    ----------
    object_signal : (P, N) complex
        True object signal.
    cleaned : (P, N) complex
        Received signal less the interference estimate, or any estimate of the object signal.

    Examples
    --------
    >>> import numpy as np
    >>> round(sinr_db(np.ones((1, 4)), 1.1 * np.ones((1, 4))), 6)
    20.0
    """
    error = np.sum(np.abs(cleaned - object_signal) ** 2)
    return float(to_db(np.sum(np.abs(object_signal) ** 2)) - to_db(error))


def error_vector_magnitude(
    object_signal: ComplexArray, cleaned: ComplexArray, beats: FloatArray, dopplers: FloatArray
) -> float:
    """Error vector magnitude of the range-Doppler map at the true objects, linear.

    The mean over the objects of ``|phi^H (cleaned - object_signal)| / |phi^H object_signal|``: the
    map is evaluated at the objects' frequencies themselves, not at the nearest cell.

    Parameters
    ----------
    object_signal, cleaned : (P, N) complex
        True object signal and received signal after cancellation.
    beats, dopplers : (L,) float
        True normalised frequencies.

    Returns
    -------
    float
        NaN without objects.
    """
    if len(beats) == 0:
        return float("nan")
    num_ramps, num_samples = object_signal.shape
    factors = line_factors(beats, num_samples), line_factors(dopplers, num_ramps)
    vectors = project(object_signal, *factors)
    return float(np.mean(np.abs(project(cleaned, *factors) - vectors) / np.abs(vectors)))


def expected_errors(std: DispersionStd) -> FloatArray:
    """Mean Euclidean errors of normal beat and Doppler errors of these deviations.

    With the larger deviation s and the smaller one r that is sqrt(2/pi) s E(1 - r^2/s^2), E the
    complete elliptic integral of the second kind.

    Parameters
    ----------
    std : DispersionStd
        Deviations, or a bound of them; a single ramp shows no Doppler.

    Returns
    -------
    (L,) float

    Examples
    --------
    >>> import numpy as np
    >>> same = DispersionStd(beats=np.ones(1), dopplers=np.ones(1))
    >>> expected_errors(same).round(6)  # sqrt(pi / 2), of a Rayleigh distribution
    array([1.253314])
    """
    dopplers = np.where(np.isinf(std.dopplers), 0.0, std.dopplers)
    larger = np.maximum(std.beats, dopplers)
    ratio = np.minimum(std.beats, dopplers) / larger
    return np.asarray(np.sqrt(2.0 / np.pi) * larger * ellipe(1.0 - ratio**2))


def paired_rms(values: FloatArray, reference: FloatArray) -> float:
    """RMS difference of two series over the places where both are defined.

    Paired with the interference-free run on the same noise this is ten times sharper than a
    difference of two averages.

    Examples
    --------
    >>> import numpy as np
    >>> paired_rms(np.array([1.0, np.nan, 4.0]), np.array([0.0, 0.0, 3.0]))
    1.0
    """
    difference = values - reference
    defined = difference[np.isfinite(difference)]
    return float(np.sqrt(np.mean(defined**2))) if len(defined) else float("nan")


def frame_metrics(
    truth: GroundTruth, beats: FloatArray, dopplers: FloatArray, cleaned: ComplexArray
) -> dict[str, float]:
    """Say in numbers what the objects of one frame are worth.

    What the cleaned frame itself is worth is said by `vsep.analysis.signal_metrics`.

    Parameters
    ----------
    truth : GroundTruth
        What the simulator put into the frame; its objects are known.
    beats, dopplers : (K,) float
        Normalised frequencies of the estimates.
    cleaned : (P, N) complex
        Received signal after cancellation.

    Returns
    -------
    dict
        ``objects_true``, ``objects``, ``misses``, ``false_alarms``; ``gospa`` in resolution cells;
        ``mean_assigned_error`` in normalised frequency; ``error_vector_magnitude``.
    """
    true = np.stack([truth.beats, truth.dopplers], axis=-1)
    found = np.stack([beats, dopplers], axis=-1)
    num_ramps, num_samples = cleaned.shape
    errors = frame_errors(true, found, (num_ramps, num_samples))
    return {
        "objects_true": len(true),
        "objects": len(found),
        "misses": errors.misses,
        "false_alarms": errors.false_alarms,
        "gospa": errors.gospa.value,
        "mean_assigned_error": errors.mean_assigned_error,
        "error_vector_magnitude": error_vector_magnitude(
            truth.object_signal, cleaned, truth.beats, truth.dopplers
        ),
    }
