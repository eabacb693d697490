"""Metrics of a cleaned frame's range-Doppler map that need no detector: gTNR and NSINR.

The cells of the map are its N P bins without window and padding. Those within `REACH_CELLS` of a
true object in both dimensions are target cells, all others background.

gTNR, the generalised target-to-noise ratio, is the generalised contrast-to-noise ratio of
A. Rodriguez-Molares et al., IEEE Trans. Ultrason. Ferroelectr. Freq. Control 67 (2020), with
targets in the place of lesions:

    gTNR = 1 - integral min(p_target(x), p_background(x)) dx

over the levels x: 1 where some levels belong to targets alone and all others to the background, 0
where both have the same distribution. No monotonic change of the levels changes it. Chosen here:
the overlap is that of the best single threshold, sup |F_target - F_background|, which equals the
integral where strong cells are always the more likely targets. A histogram's value would depend on
its bins. Cells and window are chosen, too: of many combinations these come nearest to the values of
an independent trial, see `assets/docs/bench.md`. The definition of NSINR is ours.
"""

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep.signal.spectra import range_doppler_map
from vsep.units import to_db, wrap_frequency

REACH_CELLS = 1.5  # the nearest cell of an object and its eight neighbours


def target_cells(
    beats: FloatArray, dopplers: FloatArray, shape: tuple[int, int], reach: float = REACH_CELLS
) -> BoolArray:
    """Cells of the range-Doppler map that belong to objects.

    Parameters
    ----------
    beats, dopplers : (L,) float
        True normalised frequencies.
    shape : tuple of int
        (P, N).
    reach : float
        In cells, in each dimension; around the unit circle.

    Returns
    -------
    (P, N) bool
        On the axes of `vsep.signal.spectra.range_doppler_map` without padding.

    Examples
    --------
    >>> import numpy as np
    >>> int(target_cells(np.array([0.1]), np.array([0.2]), (16, 128)).sum())
    9
    """
    near = np.ones((len(beats), *shape), dtype=np.bool_)
    for axis, (lines, size) in enumerate(zip((dopplers, beats), shape, strict=True)):
        bins = (np.arange(size) + np.ceil(-0.5 * size)) / size
        inside = np.abs(wrap_frequency(bins - lines[:, None])) * size <= reach
        near &= np.expand_dims(inside, 2 - axis)
    return np.asarray(near.any(axis=0))


def gtnr(frame: ComplexArray, targets: BoolArray) -> float:
    """Generalised target-to-noise ratio of a frame, see the module.

    Parameters
    ----------
    frame : (P, N) complex
        Received, cleaned or free of interference.
    targets : (P, N) bool
        Of `target_cells`.

    Returns
    -------
    float
        NaN without a target cell, or without any other.

    Examples
    --------
    >>> import numpy as np
    >>> beats, dopplers = np.array([0.125]), np.zeros(1)
    >>> line = np.exp(-2j * np.pi * 0.125 * np.arange(64))[None]
    >>> round(gtnr(line, target_cells(beats, dopplers, (1, 64), reach=0.5)), 3)
    1.0
    """
    levels = _powers(frame)
    own, others = np.sort(levels[targets]), np.sort(levels[~targets])
    if not (len(own) and len(others)):
        return float("nan")
    at = np.concatenate([own, others])
    below = np.searchsorted(own, at, "right") / len(own)
    below_others = np.searchsorted(others, at, "right") / len(others)
    return float(np.max(np.abs(below - below_others)))


def nsinr_db(frame: ComplexArray, clean: ComplexArray, targets: BoolArray) -> float:
    """Normalised signal to interference-plus-noise ratio of the map, in dB.

    The ratio of the mean powers of target and background cells, over the same ratio of the frame
    without interference: 0 dB is as good as no interference at all.

    Parameters
    ----------
    frame, clean : (P, N) complex
        The frame that is judged, and the same one without interference.
    targets : (P, N) bool
        Of `target_cells`.

    Returns
    -------
    float
        NaN without a target cell, or without any other.
    """
    if targets.all() or not targets.any():
        return float("nan")
    ratios = [
        float(to_db(np.mean(powers[targets])) - to_db(np.mean(powers[~targets])))
        for powers in (_powers(frame), _powers(clean))
    ]
    return ratios[0] - ratios[1]


def _powers(frame: ComplexArray) -> FloatArray:
    return range_doppler_map(frame, 1, "rectangular").power
