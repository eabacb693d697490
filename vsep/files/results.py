"""Result lines: what an estimator found in one frame, as one line of JSON.

Beat and Doppler frequencies are in the paper's sign, whatever the sign of the file.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from vsep._typing import ComplexArray
from vsep._version import __version__
from vsep.analysis.angles import object_angles, without_motion
from vsep.files.frame import Frame
from vsep.grouping.groups import ObjectGroup
from vsep.inference.core.progress import Solution
from vsep.inference.core.state import BurstComponents
from vsep.inference.deviations import curvature_std, state_deviations
from vsep.inference.evidence_choice import ChoiceState
from vsep.inference.waveforms import recognised_waveforms
from vsep.signal.radar import ChirpSequence
from vsep.units import to_db
from vsep.waveforms.doppler_division import DividedObjects


def result_line(
    file: str,
    solution: Solution,
    radar: ChirpSequence,
    spacing_wavelengths: float | None = None,
    num_transmitters: int = 1,
    received: ComplexArray | None = None,
) -> dict[str, Any]:
    """Describe one frame's solution by numbers, texts, lists and dictionaries.

    Parameters
    ----------
    file : str
        The frame's file, as the caller spelled it.
    solution : Solution
        Outcome of a run.
    radar : ChirpSequence
        The victim radar, which gives the units.
    spacing_wavelengths : float, optional
        Of a uniform line of antennas that were separated together: objects have angles.
    num_transmitters : int
        How many take turns: of the angles their motion in between is taken off.
    received : (P, N) or (A, P, N) complex, optional
        What was separated, by which interference that is no chirps is named.

    Returns
    -------
    dict
        ``file``; ``radar``; ``objects``; ``interference``, one entry per burst of all antennas;
        ``interferers``, what other radars send, see `vsep.inference.waveforms`;
        ``noise_precision`` in 1/power; ``receiver``, the errors of oscillator and receivers where
        any are evident; ``choice``, of the estimator that makes one; ``iterations``;
        ``termination``; ``seconds``; ``version`` of this package.
    """
    state = solution.state
    return {
        "file": file,
        "radar": {name: value for name, value in asdict(radar).items() if value != ()},
        "objects": _object_entries(solution, radar, spacing_wavelengths, num_transmitters),
        "interference": [_burst_entry(every, radar) for every in _of_antennas(state.bursts)],
        "interferers": [asdict(each) for each in recognised_waveforms(state, radar, received)],
        "noise_precision": state.noise_precision,
        **_receiver_entry(solution, radar),
        **_choice_entry(solution),
        "iterations": solution.iterations,
        "termination": solution.termination.name.lower(),
        "seconds": round(solution.seconds, 6),
        "version": __version__,
    }


def groups_entry(groups: Sequence[ObjectGroup]) -> dict[str, Any]:
    """Return extended objects for the line's ``groups``; nothing where there are none."""
    if not groups:
        return {}
    return {"groups": [_group_entry(group) for group in groups]}


def _group_entry(group: ObjectGroup) -> dict[str, Any]:
    columns = {
        "range_m": group.ranges_m,
        "velocity_mps": group.velocities_mps,
        "component_snr_db": to_db(group.snr),
    }
    lines = [
        {key: float(column[index]) for key, column in columns.items()}
        for index in range(group.num_lines)
    ]
    return {
        "objects": group.members.tolist(),
        "range_m": group.range_m,
        "velocity_mps": group.velocity_mps,
        "extent_m": group.extent_m,
        "strongest": lines[group.strongest],
        "weak_lines": lines[len(group.members) :],
        "log_odds": group.log_odds,
    }


def targets_entry(
    targets: DividedObjects, radar: ChirpSequence, spacing_wavelengths: float | None
) -> dict[str, Any]:
    """Return objects whose lines of several transmitters are joined, for the line's ``targets``."""
    columns = {
        "objects": targets.lines,
        "range_m": radar.range_from_beat(targets.beats),
        "velocity_mps": radar.velocity_from_doppler(targets.dopplers),
        "beat": targets.beats,
        "doppler": targets.dopplers,
        "beat_std": targets.beat_std,
        "doppler_std": targets.doppler_std,
        "amplitude": np.stack([targets.amplitudes.real, targets.amplitudes.imag], axis=-1),
    }
    if spacing_wavelengths is not None and targets.amplitudes.shape[1] > 1:
        variances = np.full(len(targets.beats), targets.variance)
        angles = object_angles(targets.amplitudes, variances, spacing_wavelengths)
        columns |= {"angle_deg": angles.angles_deg, "angle_std_deg": angles.stds_deg}
    return {
        "targets": [
            {key: column[index].tolist() for key, column in columns.items()}
            for index in range(len(targets.beats))
        ]
    }


def profile_entry(solution: Solution) -> dict[str, float]:
    """Seconds of a run by part of the algorithm, for the line's ``profile``."""
    return {name: round(seconds, 6) for name, seconds in solution.seconds_by_part.items()}


def as_json(line: Mapping[str, Any]) -> str:
    """Write a line as JSON, which knows no NaN and no infinity: they become null.

    Examples
    --------
    >>> as_json({"file": "a.npz", "objects": [{"beat_std": float("inf")}]})
    '{"file": "a.npz", "objects": [{"beat_std": null}]}'
    """
    return json.dumps(_without_nan(line), allow_nan=False)


def separated_signals(frame: Frame, solution: Solution) -> dict[str, Any]:
    """Return the separated signals in the sign and shape of the frame's file.

    Parameters
    ----------
    frame : Frame
        What was received.
    solution : Solution
        What was found in it.

    Returns
    -------
    dict
        ``object_signal``, ``interference_signal`` and ``cleaned``: received less
        interference, and what the objects predict where samples do not count.
    """
    interference = solution.state.interference_signal
    together = frame.antennas is not None and interference.size == frame.antennas.size
    received = frame.antennas if frame.antennas is not None and together else frame.received
    signals = {
        "object_signal": solution.state.object_signal,
        "interference_signal": interference,
        "cleaned": solution.state.cleaned(received.reshape(interference.shape)),
    }
    return {
        key: frame.in_file_sign(signal.reshape(received.shape)) for key, signal in signals.items()
    }


def _object_entries(
    solution: Solution,
    radar: ChirpSequence,
    spacing_wavelengths: float | None,
    num_transmitters: int,
) -> list[dict[str, Any]]:
    objects = solution.objects
    state = solution.state
    std = state_deviations(state, radar.shape, radar.migration)
    columns = {
        "beat": objects.beats,
        "doppler": objects.dopplers,
        "beat_std": std.beats,
        "doppler_std": std.dopplers,
        "delay_s": radar.delay_from_beat(objects.beats),
        "range_m": radar.range_from_beat(objects.beats),
        "doppler_hz": radar.doppler_to_hz(objects.dopplers),
        "velocity_mps": radar.velocity_from_doppler(objects.dopplers),
        "amplitude": np.stack([objects.amplitudes.real, objects.amplitudes.imag], axis=-1),
        "component_snr_db": to_db(state.component_snr),
    }
    if objects.curvatures is not None:
        columns |= {
            "acceleration_mps2": radar.acceleration_from_curvature(objects.curvatures),
            "acceleration_std_mps2": radar.acceleration_from_curvature(
                curvature_std(state, radar.num_ramps)
            ),
        }
    if spacing_wavelengths is not None and objects.amplitudes.ndim == 2:
        variances = np.diagonal(objects.covariance).real
        weights = without_motion(objects.amplitudes, objects.dopplers, num_transmitters)
        angles = object_angles(weights, variances, spacing_wavelengths)
        columns |= {"angle_deg": angles.angles_deg, "angle_std_deg": angles.stds_deg}
    return [
        {key: column[index].tolist() for key, column in columns.items()}
        for index in range(objects.num_components)
    ]


def _receiver_entry(solution: Solution, radar: ChirpSequence) -> dict[str, Any]:
    state = solution.state
    if state.receiver is None:
        return {}
    return {"receiver": state.receiver.figures(radar.sample_rate_hz, state.noise_precision)}


def _choice_entry(solution: Solution) -> dict[str, Any]:
    state = solution.state
    if not isinstance(state, ChoiceState) or state.choice is None:
        return {}
    return {"choice": {"kept": state.choice.value, "evidence_nats": state.evidence_nats}}


def _of_antennas(bursts: Iterable[BurstComponents]) -> list[list[BurstComponents]]:
    """Bursts that are one and the same at several antennas, together."""
    together: dict[tuple[int, float, float], list[BurstComponents]] = {}
    for burst in bursts:
        place = burst.ramp, burst.start_frequency, burst.slope
        together.setdefault(place, []).append(burst)
    return list(together.values())


def _burst_entry(every: list[BurstComponents], radar: ChirpSequence) -> dict[str, Any]:
    rate, burst = radar.sample_rate_hz, every[0]
    return {
        "ramp": burst.ramp,
        "start_frequency_hz": burst.start_frequency * rate,
        "slope_hz_per_s": burst.slope * rate**2,
        "num_components": sum(own.num_components for own in every),
        "energy": sum(own.energy for own in every),
    }


def _without_nan(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
