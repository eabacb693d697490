"""Angles of arrival from the weights of one object at a uniform linear array.

The weights of one object are a line spectrum over the antennas with one line, seen in white noise:
``alpha_a = alpha exp(j 2 pi a u) + noise``, ``u = d sin(theta)`` with the spacing d in wavelengths.
Maximum likelihood is the highest value of their periodogram. Up to d = 1/2 every direction has its
own u. Wider lines see sin(theta) modulo 1/d, and the direction nearest to broadside is given.
"""

from dataclasses import dataclass

import numpy as np

from vsep._typing import ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.errors import InputError

GRID_POINTS_PER_ANTENNA = 8  # of the periodogram; Newton's method converges from its best point
CLIMB_STEPS = 5


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectAngles:
    """Angles of objects in degrees from broadside towards the last antenna."""

    angles_deg: FloatArray  #: (L,) between -90 and 90
    stds_deg: FloatArray  #: (L,) their standard deviations; infinite at the ends of the line


def object_angles(
    amplitudes: ComplexArray, variances: FloatArray, spacing_wavelengths: float
) -> ObjectAngles:
    """Estimate the angle of arrival of every object by maximum likelihood.

    Parameters
    ----------
    amplitudes : (L, A) complex
        Weights of the objects at the antennas.
    variances : (L,) float
        Their posterior variance at each antenna.
    spacing_wavelengths : float
        Between neighbouring antennas.

    Raises
    ------
    InputError
        If there is one antenna only.

    Examples
    --------
    >>> import numpy as np
    >>> weights = 10.0 * np.exp(2j * np.pi * 0.25 * np.arange(4))
    >>> found = object_angles(weights[None], np.ones(1), 0.5)
    >>> np.round(found.angles_deg, 6), np.round(found.stds_deg, 2)
    (array([30.]), array([0.67]))
    """
    if amplitudes.ndim != 2 or amplitudes.shape[1] < 2:
        raise InputError(
            f"The weights have shape {amplitudes.shape}; an angle needs those of at least 2 "
            "antennas, (objects, antennas)."
        )
    cycles = np.array([_cycles_per_antenna(weights, spacing_wavelengths) for weights in amplitudes])
    sines = np.clip(cycles / spacing_wavelengths, -1.0, 1.0)
    power = np.sum(np.abs(amplitudes) ** 2, axis=1) / amplitudes.shape[1]
    snr = power / np.maximum(variances, np.finfo(np.float64).tiny)
    angles = np.degrees(np.arcsin(sines))
    stds = angle_bound_deg(snr, angles, amplitudes.shape[1], spacing_wavelengths)
    return ObjectAngles(angles_deg=angles.reshape(-1), stds_deg=stds.reshape(-1))


def without_motion(
    amplitudes: ComplexArray, dopplers: FloatArray, num_transmitters: int
) -> ComplexArray:
    """Turn the weights of transmitters that take turns back to the time of the first.

    Transmitter t of T sends t/T of a ramp period later; until then an object turns by
    ``exp(-j 2 pi doppler t / T)``.

    Parameters
    ----------
    amplitudes : (L, A) complex
        Weights of the objects, transmitter by transmitter.
    dopplers : (L,) float
        Their Doppler frequencies in cycles per ramp of one transmitter.
    num_transmitters : int
        T.

    Examples
    --------
    >>> import numpy as np
    >>> without_motion(np.array([[1.0, -1.0j]]), np.array([0.5]), 2).round(9) + 0.0
    array([[1.+0.j, 1.+0.j]])
    """
    later = np.repeat(np.arange(num_transmitters), amplitudes.shape[1] // num_transmitters)
    return np.asarray(
        amplitudes * np.exp(2j * np.pi * np.outer(dopplers, later / num_transmitters))
    )


def angle_bound_deg(
    snr: FloatArray, angles_deg: FloatArray, num_antennas: int, spacing_wavelengths: float
) -> FloatArray:
    """Root of the Cramer-Rao bound of an angle of arrival, in degrees.

    Parameters
    ----------
    snr : (L,) float
        Power of an object's weight at one antenna over the variance of its estimate: for an
        isolated object, (25) of one antenna.
    angles_deg : (L,) float
        Its angle.
    num_antennas : int
        A.
    spacing_wavelengths : float
        d.

    Returns
    -------
    (L,) float
        ``sqrt(6 / (snr A (A^2 - 1))) / (2 pi d cos(theta))``; infinite at +-90 degrees.

    Examples
    --------
    >>> import numpy as np
    >>> np.round(angle_bound_deg(np.array([100.0]), np.zeros(1), 4, 0.5), 3)
    array([0.577])
    """
    require_range("num_antennas", num_antennas, 2, 1024)
    count = float(num_antennas)
    cycles = np.sqrt(6.0 / (snr * count * (count**2 - 1.0))) / (2.0 * np.pi)
    cosine = np.cos(np.radians(angles_deg))
    at_the_end = np.abs(np.abs(angles_deg) - 90.0) < 1e-9
    slope = spacing_wavelengths * np.where(at_the_end, 1.0, cosine)
    return np.asarray(np.where(at_the_end, np.inf, np.degrees(cycles / slope)))


def _cycles_per_antenna(weights: ComplexArray, spacing_wavelengths: float) -> float:
    """Highest point u of the periodogram of (A,) weights among those that a direction has."""
    reach = min(0.5, spacing_wavelengths)
    number = GRID_POINTS_PER_ANTENNA * len(weights) + 1
    grid = np.linspace(-reach, reach, number)
    places = np.arange(len(weights)) - 0.5 * (len(weights) - 1)
    values = np.abs(np.exp(-2j * np.pi * np.outer(grid, places)) @ weights)
    best, width = float(grid[int(np.argmax(values))]), float(grid[1] - grid[0])
    lowest, highest = best - width, best + width
    for _ in range(CLIMB_STEPS):
        waves = np.exp(-2j * np.pi * best * places) * weights
        sums = [np.sum((-2j * np.pi * places) ** order * waves) for order in range(3)]
        gradient = (sums[0].conjugate() * sums[1]).real
        bend = abs(sums[1]) ** 2 + (sums[0].conjugate() * sums[2]).real
        if bend >= 0.0:
            break
        best = min(max(best - gradient / bend, lowest), highest)
    # Beyond half a turn the same direction is on the other side; beyond the line's end there is no
    # direction at all.
    if spacing_wavelengths >= 0.5:
        return (best + 0.5) % 1.0 - 0.5
    return min(max(best, -reach), reach)
