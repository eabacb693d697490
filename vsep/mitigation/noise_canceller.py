"""Adaptive noise canceller of F. Jin and S. Cao, IEEE Transactions on Vehicular Technology, 2019.

Objects lie on one side of the beat spectrum, a burst that crosses the band lies on both. The
mirrored empty side is the reference of a normalised least-mean-squares filter along the frequency
bins; what the filter predicts of the objects' side is taken away, and the empty side becomes zero.

Chosen here: a burst is symmetric about the sample at which it crosses zero frequency, so the ramp
is turned until the middle of its flagged samples stands at time zero, where both sides of the
spectrum are equal. Ramps without a flagged sample stay as they are.
"""

from functools import partial

import numpy as np
from scipy import fft

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep._validation import require_range
from vsep.mitigation.blanking import zeroed
from vsep.mitigation.direct import DirectMitigation
from vsep.mitigation.entry import time_domain_entry
from vsep.mitigation.method import FrameArray

TAPS = 8
STEP = 0.5  # of the normalised filter; 2 is where it diverges


def noise_canceller(taps: int = TAPS, step: float = STEP) -> DirectMitigation:
    """Make the adaptive noise canceller.

    Parameters
    ----------
    taps : int
        Length of the adaptive filter in frequency bins.
    step : float
        Step size of the normalised least-mean-squares rule.

    Raises
    ------
    InputError
        If a setting is out of its range.
    """
    require_range("taps", taps, 1, 256)
    require_range("step", step, 1e-6, 2.0)
    return DirectMitigation("noise-canceller", partial(cancelled, taps=taps, step=step))


def cancelled(
    received: FrameArray, mask: BoolArray, taps: int = TAPS, step: float = STEP
) -> FrameArray:
    """Return the frame with the predictable part of its interfered ramps taken away.

    Parameters
    ----------
    received : (P, N) complex
        The frame.
    mask : (P, N) bool
        Tells which ramps are interfered, where their bursts are, and by the clean samples on which
        side of the spectrum the objects lie.
    taps, step
        As for `noise_canceller`.
    """
    hit = np.flatnonzero(mask.any(axis=1))
    num_samples = received.shape[1]
    half = (num_samples - 1) // 2
    if len(hit) == 0 or half == 0:
        return received
    positive, negative = np.arange(1, half + 1), num_samples - np.arange(1, half + 1)
    side = np.abs(fft.ifft(zeroed(received, mask), axis=1)) ** 2
    if side[:, positive].sum() >= side[:, negative].sum():
        objects, reference = positive, negative
    else:
        objects, reference = negative, positive
    bins = fft.fftfreq(num_samples)
    # The spectra are inverse DFTs: this phase moves the middle of a burst to time zero.
    turn = np.exp(-2j * np.pi * np.outer(_middles(mask[hit]), bins))
    spectra = fft.ifft(received[hit].astype(np.complex128), axis=1) * turn
    kept = spectra.copy()
    kept[:, reference] = 0.0
    kept[:, objects] = _filter_errors(spectra[:, objects], spectra[:, reference], taps, step)
    cleaned = received.copy()
    cleaned[hit] = fft.fft(kept * turn.conj(), axis=1)
    return cleaned


def _middles(mask: BoolArray) -> FloatArray:
    """(P,) mean position of the flagged samples of every ramp."""
    return np.asarray((mask * np.arange(mask.shape[1])).sum(axis=1) / mask.sum(axis=1))


def _filter_errors(
    wanted: ComplexArray, reference: ComplexArray, taps: int, step: float
) -> ComplexArray:
    """Errors of the adaptive filter that predicts `wanted` (P, K) from `reference` (P, K)."""
    padded = np.pad(reference, ((0, 0), (taps - 1, 0)))
    # The energies of two sides with nothing in them must not divide zero by zero.
    floor = np.finfo(np.float64).tiny + 1e-6 * taps * np.mean(np.abs(reference) ** 2, axis=1)
    weights = np.zeros((len(wanted), taps), dtype=np.complex128)
    errors = np.empty_like(wanted)
    for index in range(wanted.shape[1]):
        inputs = padded[:, index : index + taps]
        error = wanted[:, index] - np.sum(weights * inputs, axis=1)
        energy = floor + np.sum(np.abs(inputs) ** 2, axis=1)
        weights += step * (error / energy)[:, None] * inputs.conj()
        errors[:, index] = error
    return errors


ENTRIES = (
    time_domain_entry(
        "noise-canceller",
        "Adaptive noise canceller",
        60,
        "Takes away what the empty side of the beat spectrum predicts of the other side.",
        noise_canceller,
    ),
)
