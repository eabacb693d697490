"""One trial: simulate the scene, run every method, return one flat row for each.

`run_trial` is a pure function at the top level of a module, so that any worker process of any
machine can run it. What goes wrong inside becomes a row with its reason.
"""

from dataclasses import asdict, replace
from typing import Any, Final, TypeAlias

import numpy as np

from vsep._typing import BoolArray, ComplexArray, FloatArray
from vsep._version import __version__
from vsep.analysis.crlb import DispersionBound
from vsep.analysis.metrics import (
    FrameErrors,
    error_vector_magnitude,
    expected_errors,
    frame_errors,
)
from vsep.analysis.repair import mask_errors
from vsep.analysis.separability import separability
from vsep.analysis.signal_metrics import signal_metrics
from vsep.inference.core.progress import Solution
from vsep.inference.core.run import run
from vsep.inference.core.state import SeparationState
from vsep.inference.deviations import state_deviations
from vsep.kernels.clock import computing_s
from vsep.mitigation.masks.detectors import detect_interference
from vsep.mitigation.method import mitigate
from vsep.signal.scene import Observation
from vsep.signal.template import SignalModel
from vsep.studies.gap_trial import gap_frames, gap_results
from vsep.studies.methods import MASKED_BY_DETECTOR, NO_INTERFERENCE, repair_of, trial_estimator
from vsep.studies.scenario import TrialScenario
from vsep.studies.study import GapPoint, Trial
from vsep.studies.trial_scenario import simulate_trial

Row: TypeAlias = dict[str, Any]
Bounds: TypeAlias = tuple[DispersionBound, DispersionBound]  # interference unknown, known

DONE, FAILED = "done", "failed"
ABRUPT_END: Final = "the worker process ended abruptly"
# A trial asks nothing of its machine but memory and its libraries.
_OUTSIDE: Final = (MemoryError, OSError)
_OUTSIDE_REASONS: Final = (
    ABRUPT_END,
    *(f"{kind.__name__}: " for kind in _OUTSIDE),
    # As rows of older versions have them.
    "_ArrayMemoryError: ",
    "KilledWorker: ",
)
# Enough for paired differences of a thousandth of a standard deviation.
_SIGNIFICANT_DIGITS = 7


def run_trial(trial: Trial) -> list[Row]:
    """Run all methods of a trial on its scene.

    Parameters
    ----------
    trial : Trial
        What to do.

    Returns
    -------
    list of dict
        One row per method, in their order; apart from ``seconds`` a function of the trial alone.
        A row of status "failed" has a ``reason``, and no results.
    """
    if isinstance(trial.point, GapPoint):
        return _gap_rows(trial)
    try:
        drawn = simulate_trial(trial)
        bounds = drawn.bounds()
        shared = _scene_entries(drawn, bounds) | _mask_entries(trial, drawn)
    except Exception as error:  # whatever it is, the study goes on and the row tells
        return failed_rows(trial, reason_of(error))
    return [_run_method(trial, method, drawn, bounds, shared) for method in trial.methods]


def _gap_rows(trial: Trial) -> list[Row]:
    """Run all methods on a sequence with gaps."""
    assert isinstance(trial.point, GapPoint)
    shape = {"num_ramps": trial.point.num_ramps, "num_samples": trial.point.num_samples}
    frames = gap_frames(trial)
    rows = []
    for method in trial.methods:
        try:
            results = gap_results(trial, method, frames)
        except Exception as error:  # as below
            rows.append(_failed_row(trial, method, reason_of(error)))
            continue
        short = {
            name: _short(value) if isinstance(value, float) else value
            for name, value in results.items()
        }
        rows.append({**_head(trial, method), "status": DONE, "reason": None, **shape, **short})
    return rows


def reason_of(error: BaseException) -> str:
    """Say in a row why a trial has no result.

    Examples
    --------
    >>> reason_of(ZeroDivisionError("division by zero")), reason_of(FileNotFoundError("a.npz"))
    ('ZeroDivisionError: division by zero', 'OSError: a.npz')
    """
    kind = next((one for one in _OUTSIDE if isinstance(error, one)), type(error))
    return f"{kind.__name__}: {error}"


def is_missing(row: Row) -> bool:
    """Whether a row has no result for a reason outside of its trial: it is worth another run.

    That is a worker process that was killed, and what memory, disk or network did not have.
    """
    return row["status"] == FAILED and (row.get("reason") or "").startswith(_OUTSIDE_REASONS)


def failed_rows(trial: Trial, reason: str) -> list[Row]:
    """Return the rows of a trial that has no results."""
    return [_failed_row(trial, method, reason) for method in trial.methods]


def separate(trial: Trial, method: str, drawn: TrialScenario) -> tuple[Observation, Solution]:
    """Run one method of a trial; return the frame its estimator saw and what that made of it."""
    observation = drawn.clean if method == NO_INTERFERENCE else drawn.interfered
    start = computing_s()
    mask = _mask_of(drawn, MASKED_BY_DETECTOR.get(method, trial.point.mask))
    repair = repair_of(method, trial.handed)
    if repair is not None:
        settings = repair.accepted(dither=drawn.scenario.radar.dither)
        cleaned = mitigate(repair.make(**settings), observation.received, mask).cleaned
        received = np.asarray(cleaned, dtype=np.complex128)
        observation = Observation(received=received, truth=observation.truth)
    seconds = computing_s() - start
    estimator = trial_estimator(
        method,
        drawn.model,
        trial.point,
        trial.settings,
        mask,
        trial.handed,
        max_iterations=drawn.max_iterations,
    )
    solution = run(estimator, observation.received)
    return observation, replace(solution, seconds=solution.seconds + seconds)


def _mask_of(drawn: TrialScenario, name: str) -> BoolArray:
    """Return the interfered samples, as the truth or a detector has them."""
    if name == "truth":
        return drawn.truth.perfect_mask()
    return detect_interference(name, drawn.interfered.received, drawn.scenario.radar.dither)


def _mask_entries(trial: Trial, drawn: TrialScenario) -> Row:
    """Errors of a detector's mask: missed of what is 10 dB above the noise, false of 10 dB below.

    What lies between no detector can be right about.
    """
    if trial.point.mask == "truth":
        return {}
    found = _mask_of(drawn, trial.point.mask)
    above, below = (drawn.truth.perfect_mask(share) for share in (10.0, 0.1))
    return {
        "mask_missed": _short(mask_errors(above, found).missed),
        "mask_false": _short(mask_errors(below, found).false),
    }


def _run_method(
    trial: Trial, method: str, drawn: TrialScenario, bounds: Bounds, shared: Row
) -> Row:
    try:
        observation, solution = separate(trial, method, drawn)
        results = _result_entries(trial, drawn, observation, solution)
        unknown, known = bounds
        results |= _bound_entries(results, known if method == NO_INTERFERENCE else unknown)
    except Exception as error:  # as above
        return _failed_row(trial, method, reason_of(error))
    return {**_head(trial, method), "status": DONE, "reason": None, **shared, **results}


def _failed_row(trial: Trial, method: str, reason: str) -> Row:
    return {**_head(trial, method), "status": FAILED, "reason": reason}


def _head(trial: Trial, method: str) -> Row:
    """Everything that says which trial a row belongs to."""
    return {
        "study": trial.study,
        "point_index": trial.point_index,
        "point": trial.point.parameters(),
        "realization": trial.realization,
        "method": method,
        **asdict(trial.settings),
        "version": __version__,
    }


def _bound_entries(results: Row, bound: DispersionBound) -> Row:
    """Compare the errors of the assigned objects, where there are any, with what a bound allows."""
    if not results["assigned"]:
        return {}
    expected = expected_errors(bound)[results["assigned"]]
    return {"error_over_bound": _short(float(np.mean(np.array(results["errors"]) / expected)))}


def _scene_entries(drawn: TrialScenario, bounds: Bounds) -> Row:
    """Describe the scene, which all methods of a trial share."""
    truth = drawn.truth
    ratio = separability(truth.beats, truth.dopplers, truth.amplitudes, truth.interference_signal)
    unknown, known = bounds
    num_ramps, num_samples = drawn.model.shape
    return {
        "preset": drawn.preset,
        "num_ramps": num_ramps,
        "num_samples": num_samples,
        "num_interfered_ramps": len({burst.ramp for burst in truth.bursts}),
        "num_objects_true": len(truth.beats),
        "root_crlb": _short(unknown.root_mean_crlb),
        "root_crlb_known": _short(known.root_mean_crlb),
        "separability_db": _short(ratio.whole_db),
        "separability_weakest_db": _short(ratio.weakest_db),
    }


def _result_entries(
    trial: Trial, drawn: TrialScenario, observation: Observation, solution: Solution
) -> Row:
    """Compare one solution with the truth."""
    truth, objects, shape = drawn.truth, solution.objects, drawn.model.shape
    settings = trial.settings
    errors = frame_errors(
        np.stack([truth.beats, truth.dopplers], axis=1),
        np.stack([objects.beats, objects.dopplers], axis=1),
        shape,
        cutoff=settings.gospa_cutoff,
        order=settings.gospa_order,
    )
    cleaned = solution.state.cleaned(observation.received)
    signal = signal_metrics(truth, drawn.interfered.received, cleaned)
    evm = error_vector_magnitude(truth.object_signal, cleaned, truth.beats, truth.dopplers)
    return {
        "num_objects": objects.num_components,
        "misses": errors.misses,
        "false_alarms": errors.false_alarms,
        "errors": _short_list(errors.errors),
        **_assigned_entries(errors, solution, drawn.model),
        "gospa": _short(errors.gospa.value),
        "gospa_localisation": _short(errors.gospa.localisation),
        "gospa_missed": errors.gospa.missed,
        "gospa_false": errors.gospa.false,
        **{name: _short(value) for name, value in signal.items()},
        "evm": _short(evm),
        "nmse": _short(_relative_error(truth.object_signal, solution.state.object_signal)),
        "num_bursts": len(solution.state.interfered_ramps),
        "channel_components": _short(_components_per_ramp(solution.state)),
        "iterations": solution.iterations,
        "termination": solution.termination.name.lower(),
        "seconds": round(solution.seconds, 6),
    }


def _assigned_entries(errors: FrameErrors, solution: Solution, model: SignalModel) -> Row:
    """Signed errors and reported standard deviations of the assigned objects, truth by truth."""
    found = errors.found_indices
    std = state_deviations(solution.state, model.shape, model.migration)
    entries = {
        "assigned": errors.gospa.true_indices.tolist(),
        "beat_errors": _short_list(errors.beat_errors),
        "beat_stds": _short_list(std.beats[found]),
    }
    if model.num_ramps > 1:
        entries["doppler_errors"] = _short_list(errors.doppler_errors)
        entries["doppler_stds"] = _short_list(std.dopplers[found])
    return entries


def _components_per_ramp(state: SeparationState) -> float:
    """Components of the interference channel in a ramp with bursts; none without bursts."""
    found = sum(len(burst.active_bins) for burst in state.bursts)
    return found / max(len(state.interfered_ramps), 1)


def _relative_error(true: ComplexArray, found: ComplexArray) -> float:
    """Energy of an error over that of what is true; NaN where that is nothing."""
    energy = float(np.sum(np.abs(true) ** 2))
    return float(np.sum(np.abs(found - true) ** 2)) / energy if energy else float("nan")


def _short(value: float) -> float:
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}")


def _short_list(values: FloatArray) -> list[float]:
    return [_short(value) for value in values.tolist()]
