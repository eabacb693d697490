"""Trials of compressive sensing on sequences of frames with gaps, (11) to (17) of its source."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.fft import ifft2

from vsep._typing import BoolArray, ComplexArray, IntArray
from vsep.analysis.repair import gap_error_db
from vsep.errors import InputError
from vsep.mitigation.cfar import Cfar
from vsep.mitigation.masks.detectors import detect_interference
from vsep.mitigation.method import Mitigation, MitigationState, iterate_mitigation
from vsep.mitigation.registry import MITIGATIONS
from vsep.mitigation.sparse.filling import SparseMitigation
from vsep.mitigation.sparse.prior import PriorModel, SeenFrame
from vsep.mitigation.sparse.thresholding import IterativeThresholding
from vsep.signal.spectra import hann_window
from vsep.studies.gap_frames import GapFrame, gap_radar, gap_sequence
from vsep.studies.methods import NO_INTERFERENCE
from vsep.studies.study import GapPoint, Trial

_PLAIN = "ist"
_NEAR_DB = 0.5  # of where the plain method ends
_NEAR_CELLS = 2
# What rows of estimators have, and these have not.
_LISTS = ("errors", "assigned", "beat_errors", "beat_stds", "doppler_errors", "doppler_stds")
_DETECTOR = Cfar(false_alarm_rate=1e-6)


def gap_frames(trial: Trial) -> tuple[list[GapFrame], list[GapFrame]]:
    """Draw the sequence of a trial, and one of other objects where a wrong prior has seen it."""
    point = trial.point
    assert isinstance(point, GapPoint)
    radar = gap_radar(point.num_ramps, point.num_samples)
    own_seed, other_seed = trial.seed_sequence.spawn(2)
    own, other = (
        list(
            gap_sequence(
                np.random.default_rng(seed),
                radar,
                share=point.share_lost,
                snr_db=point.snr_db,
                sir_db=point.sir_db,
                num_frames=point.num_prior_frames + 1,
            )
        )
        if seed is not None
        else []
        for seed in (own_seed, other_seed if point.prior == "other" else None)
    )
    return own, other


def gap_results(
    trial: Trial, method: str, frames: tuple[list[GapFrame], list[GapFrame]]
) -> dict[str, Any]:
    """Run a method on the last frame of a sequence, with the prior of the frames before it.

    Parameters
    ----------
    trial : Trial
        Of a `GapPoint`.
    method : str
        One of the compressive-sensing methods, or "no-interference" for intact samples.
    frames : pair of lists
        Of `gap_frames`.

    Returns
    -------
    dict
        Entries of a row: error in the gaps; iterations, and those to within half a dB of where soft
        thresholding without a prior ends; peaks of CA-CFAR that the intact frame has not; seconds
        of processor time.

    Raises
    ------
    InputError
        If the method is none of compressive sensing.
    """
    point, (own, other) = trial.point, frames
    assert isinstance(point, GapPoint)
    last = own[-1]
    mask = _mask(point, last, np.random.default_rng(trial.seed_sequence.spawn(3)[2]))
    repair = _Repair(point, method)
    start = time.process_time()
    if method == NO_INTERFERENCE:
        states: list[MitigationState] = []
        cleaned: ComplexArray = last.intact
    else:
        seen = own if point.prior == "own" else other
        history = repair.history(seen[:-1])
        start = time.process_time()
        states = list(iterate_mitigation(repair.make(history), last.received, mask))
        # A detector may find nothing: then there is nothing to fill.
        filled = states[-1].cleaned if states else last.received
        cleaned = np.asarray(filled, dtype=np.complex128)
    seconds = time.process_time() - start
    objects = last.truth.object_signal
    found, expected = _peaks(cleaned), _peaks(last.intact)
    return {
        "num_objects_true": len(expected),
        "num_objects": len(found),
        "misses": _strangers(expected, found, objects.shape),
        "false_alarms": _strangers(found, expected, objects.shape),
        **{name: [] for name in _LISTS},
        "gap_error_db": gap_error_db(objects, cleaned, last.mask),
        "iterations_to_plain": _iterations_to_plain(point, last, mask, states),
        "num_clean": int(np.count_nonzero(~mask)),
        "operator_megabytes": repair.operator_megabytes(mask),
        "iterations": len(states),
        "iteration_ms": 1e3 * seconds / max(len(states), 1),
        "termination": "converged",
        "seconds": round(seconds, 6),
    }


class _Repair:
    """Makes a method with the settings of a point."""

    def __init__(self, point: GapPoint, method: str) -> None:
        self._point, self._method = point, method

    def make(self, history: tuple[SeenFrame, ...]) -> Mitigation:
        """Return the method that knows a history, if it can."""
        point, entry = self._point, MITIGATIONS.require(self._method)
        settings = {"history": history or None, "debias": point.debias or None}
        made = entry.make(**entry.accepted(**settings, domain=point.domain))
        if not isinstance(made, SparseMitigation):
            raise InputError(f"method is {self._method}; sequences take compressive sensing only.")
        if isinstance(made.solver, IterativeThresholding):
            changes: dict[str, Any] = {"step_width": point.step_width}
            if point.control is not None:
                changes["control"] = point.control
            if point.threshold != "own":
                changes["threshold"] = point.threshold
            made = replace(made, solver=replace(made.solver, **changes))
        return made

    def history(self, frames: list[GapFrame]) -> tuple[SeenFrame, ...]:
        """Return what the prior has seen of frames; nothing for a method without one."""
        prior = MITIGATIONS.require(self._method).prior
        if prior is None:
            return ()
        model: PriorModel = replace(prior, num_frames=max(self._point.num_prior_frames, 1))
        history: tuple[SeenFrame, ...] = ()
        for frame in frames:
            if self._point.prior_source == "original":
                history = model.see(history, frame.received)
                continue
            *_, state = iterate_mitigation(self.make(history), frame.received, frame.mask)
            history = model.see(history, state.cleaned)
        return history

    def operator_megabytes(self, mask: BoolArray) -> float:
        """Memory that the operator keeps: the explicit matrix, or the mask."""
        clean = np.count_nonzero(~mask)
        entries = 2 * clean * mask.size if self._point.domain == "explicit-1d" else mask.size
        return 8e-6 * float(entries)


def _mask(point: GapPoint, frame: GapFrame, rng: np.random.Generator) -> BoolArray:
    """Return what is not used: samples that are hit, and those not drawn where p of a ramp are."""
    mask = frame.mask
    if point.mask != "truth":
        mask = detect_interference(point.mask, frame.received)
    if point.samples_per_ramp is None:
        return mask
    order = np.argsort(rng.uniform(size=mask.shape) + np.where(mask, 1.0, 0.0), axis=1)
    drawn = np.zeros(mask.shape, dtype=np.bool_)
    np.put_along_axis(drawn, order[:, : point.samples_per_ramp], True, axis=1)
    return np.asarray(mask | ~drawn)


def _iterations_to_plain(
    point: GapPoint, frame: GapFrame, mask: BoolArray, states: list[MitigationState]
) -> float:
    """Count iterations to within half a dB of where soft thresholding without a prior ends."""
    if not states:
        return float("nan")
    plain = _Repair(
        replace(point, control=None, threshold="own", step_width=1.0, debias=False), _PLAIN
    ).make(())
    *_, end = iterate_mitigation(plain, frame.received, mask)
    objects = frame.truth.object_signal
    limit_db = gap_error_db(objects, np.asarray(end.cleaned), frame.mask) + _NEAR_DB
    for number, state in enumerate(states, start=1):
        if gap_error_db(objects, np.asarray(state.cleaned), frame.mask) <= limit_db:
            return float(number)
    return float("nan")


def _peaks(frame: ComplexArray) -> IntArray:
    """(K, 2) cells in which CA-CFAR finds a peak."""
    if not _DETECTOR.fits(frame.shape):
        return np.zeros((0, 2), dtype=np.int64)
    window = np.outer(hann_window(frame.shape[0]), hann_window(frame.shape[1]))
    return _DETECTOR.peaks(np.abs(ifft2(window * frame)) ** 2)


def _strangers(peaks: IntArray, expected: IntArray, shape: tuple[int, ...]) -> int:
    """Count peaks more than two cells away from every expected one."""
    apart = np.abs(peaks[:, None] - expected)
    apart = np.minimum(apart, np.array(shape) - apart)
    return int(np.sum(~np.any(np.all(apart <= _NEAR_CELLS, axis=2), axis=1)))
