"""What is measured on the radarlab recordings, where the folder of `VSEP_RECORDINGS` holds them.

As a script it writes the tables of `assets/docs/calibration.md`, and says how long a run takes:

    VSEP_RECORDINGS=folder python -m tests.vsep.recording_bench assets/results
"""

import os
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.vsep.result_tables import write_table
from vsep.calibration.calibrate import calibrate
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.inference.objects.masked import MaskedSeparator
from vsep.inference.objects.object_only import ObjectOnlySeparator
from vsep.mitigation.method import mitigate
from vsep.mitigation.registry import make_mitigation
from vsep.signal.clutter import static_clutter
from vsep.signal.filters import NoFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.scene import Channel, Interferer
from vsep.signal.simulate import add_interference
from vsep.signal.template import SignalModel
from vsep.units import to_db

INTERFERED, CLEAN = "radarlab_20180608-195044.npz", "radarlab_20180613-190347.npz"
SLOPE = -19.312e12  # by the settings of both radars, in the paper's sign
RATE = 20e6
CAR = (42, 73)  # Doppler and range bin
SETTLED = 96  # samples after which the receivers have settled
RADAR = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=29.306e12,
    sample_rate_hz=RATE,
    ramp_period_s=29.56e-6,
    num_samples=512,
    num_ramps=128,
)


def recording(name):
    """Signals (4, 128, 512) in the paper's sign and the annotated mask; skips where absent."""
    path = Path(os.environ.get("VSEP_RECORDINGS", "")) / name
    if "VSEP_RECORDINGS" not in os.environ or not path.exists():
        pytest.skip(f"VSEP_RECORDINGS names no folder that holds {name}")
    with np.load(path, allow_pickle=False) as stored:
        return np.conj(stored["x"].astype(np.complex128)), stored["burst_mask"]


def car_sir_db(received):
    """Range-Doppler SIR of the car in a (128, 512) frame of the paper's sign.

    Power of the car's cell over the 400 cells at a distance of 4 to 13 in both directions, times
    392; no window.
    """
    spectrum = np.fft.fftshift(np.fft.fft2(np.conj(received)), axes=0)
    power = np.abs(spectrum) ** 2
    offsets = np.concatenate([np.arange(-13, -3), np.arange(4, 14)])
    around = power[np.ix_(CAR[0] + offsets, CAR[1] + offsets)]
    return float(10.0 * np.log10(392.0 * power[CAR] / around.sum()))


def model_with(anti_aliasing_filter, num_samples=RADAR.num_samples):
    radar = replace(RADAR, num_samples=num_samples)
    return SignalModel.of_radar(radar, anti_aliasing_filter)


def lines_of(state):
    """Beat and Doppler frequencies (L, 2) of the objects of a state."""
    return np.stack([state.objects.beats, state.objects.dopplers], axis=1)


def matched(lines, others, cells=1.0, shape=RADAR.shape):
    """Which of `lines` have one of `others` within `cells` resolution cells in both axes."""
    apart = np.abs((lines[:, None] - others[None] + 0.5) % 1.0 - 0.5) * shape[::-1]
    return np.any(np.all(apart <= cells, axis=2), axis=1)


def car_of(moving, ramps=None):
    """Range in m and velocity in m/s of the car: the highest point of the spectrum near its cell.

    Of some ramps only where `ramps` names them, which need not be regular.
    """
    ramps = np.arange(RADAR.num_ramps) if ramps is None else ramps
    # Objects lie at positive frequencies of the file, the paper's basis has the minus sign.
    place = np.array([CAR[1] / RADAR.num_samples, (CAR[0] - 64) / RADAR.num_ramps])
    n, reach = np.arange(RADAR.num_samples), np.array([1.5, 1.5]) / RADAR.shape[::-1]
    for _ in range(4):
        beats, dopplers = (
            centre + width * np.linspace(-1.0, 1.0, 31)
            for centre, width in zip(place, reach, strict=True)
        )
        by_beat = moving[ramps] @ np.exp(2j * np.pi * np.outer(n, beats))
        power = np.abs(np.exp(2j * np.pi * np.outer(dopplers, ramps)) @ by_beat)
        row, column = np.unravel_index(np.argmax(power), power.shape)
        place, reach = np.array([beats[column], dopplers[row]]), reach / 8.0
    return float(RADAR.range_from_beat(place[0])), float(RADAR.velocity_from_doppler(place[1]))


def separated(frame, response):
    """State of the separator after one antenna, and the processor seconds that it took."""
    start = time.process_time()
    state = run(FactorisedSeparator(model=model_with(response)), frame).state
    return state, time.process_time() - start


def masked_lines(moving, mask, max_iterations=60):
    model = model_with(NoFilter(), moving.shape[1])
    return run(MaskedSeparator(model=model, mask=mask, max_iterations=max_iterations), moving).state


def grown(mask, samples=40):
    """The annotated mask with the weak tails of the bursts."""
    wide = mask.copy()
    for shift in range(1, samples + 1):
        wide[:, shift:] |= mask[:, :-shift]
    return wide


def car_row(index, signals, mask, response):
    """One antenna of the interfered recording: everything that is asked of it."""
    antenna = signals[index]
    moving = antenna - static_clutter(antenna)
    state, seconds = separated(moving, response.filter_of(index))
    kept, seconds_kept = separated(antenna, response.filter_of(index))
    sys.stdout.write(f"antenna {index}: {seconds:.1f} s, clutter kept {seconds_kept:.1f} s\n")
    own = calibrate([antenna[None]], RATE).estimate.response.filter_of(0)
    by_own, _ = separated(moving, own)
    hit = mask.any(axis=1)
    # without the errors of the receiver that are evident
    left = state.corrected(moving) - state.object_signal - state.interference_signal
    rest = np.abs(left) ** 2
    beside = masked_lines(moving, grown(mask))
    stray = ~matched(lines_of(state), lines_of(beside))
    in_clean = car_of(moving, np.flatnonzero(~hit))
    range_m, velocity_mps = car_of(moving - state.interference_signal)
    return {
        "antenna": index,
        "sir_received_db": car_sir_db(antenna),
        "sir_zeroed_db": car_sir_db(np.where(mask, 0.0, antenna)),
        "sir_separated_db": car_sir_db(antenna - state.interference_signal),
        "sir_cleaned_db": car_sir_db(state.cleaned(moving)),
        "sir_cleaned_own_response_db": car_sir_db(by_own.cleaned(moving)),
        "sir_cleaned_clutter_kept_db": car_sir_db(kept.cleaned(antenna)),
        "range_m": range_m,
        "velocity_mps": velocity_mps,
        "range_of_clean_part_m": in_clean[0],
        "velocity_of_clean_part_mps": in_clean[1],
        "floor_over_clean_ramps_db": float(to_db(rest.mean() / rest[~hit].mean())),
        "floor_of_hit_ramps_db": float(to_db(rest[hit].mean() / rest[~hit].mean())),
        "objects": state.objects.num_components,
        "objects_masked": beside.objects.num_components,
        "objects_not_in_masked": int(stray.sum()),
        "bursts": len(state.bursts),
        "iterations": state.iteration,
        "objects_clutter_kept": kept.objects.num_components,
        "iterations_clutter_kept": kept.iteration,
    }


def interferer(slope_difference):
    """A radar that crosses every fourth ramp, from 2 us after its start to 23 us.

    The crossing lies where ``k_V t = k_I (t - offset)``.
    """
    slope = RADAR.slope_hz_per_s - slope_difference
    offset_per_crossing = -slope_difference / slope
    drift_s = offset_per_crossing * 21e-6 / 31.0
    return Interferer(
        sequence=InterfererSequence(
            start_frequency_hz=77e9,
            slope_hz_per_s=slope,
            ramp_duration_s=115e-6,
            ramp_period_s=4.0 * RADAR.ramp_period_s + drift_s,
            num_ramps=32,
            time_offset_s=offset_per_crossing * 2e-6,
        ),
        channel=Channel(
            delays_s=np.zeros(1), dopplers_hz=np.zeros(1), weights=np.ones(1, np.complex128)
        ),
    )


def sweep_rows(slope_differences, sirs_db, *, max_iterations=30):
    """Clean recording plus bursts: detections of every method against the clean frames' own.

    Sums over the four antennas, each a frame of its own. Without the samples in which the receiver
    settles: what it leaves in them is no object.
    """
    interfered, _ = recording(INTERFERED)
    clean, _ = recording(CLEAN)
    halves = [
        calibrate([interfered[:, rows]], RATE, SLOPE).estimate.response
        for rows in (slice(0, 64), slice(64, 128))
    ]
    moving = clean - static_clutter(clean)
    settled = moving[..., SETTLED:]
    model = model_with(NoFilter(), settled.shape[-1])
    objects = [
        run(ObjectOnlySeparator(model=model, max_iterations=60), own).state for own in settled
    ]
    for slope_difference in slope_differences:
        for sir_db in sirs_db:
            points = []
            for index, own in enumerate(moving):
                observation = add_interference(
                    RADAR,
                    own,
                    [interferer(slope_difference)],
                    sir_db=sir_db,
                    anti_aliasing_filter=halves[1].filter_of(index),
                )
                response = halves[0].filter_of(index)
                points.append(sweep_point(observation, objects[index], response, max_iterations))
            row = {name: sum(point[name] for point in points) for name in points[0]}
            yield row | {
                "mask_share": row["mask_share"] / len(points),
                "slope_difference_mhz_per_us": slope_difference / 1e12,
                "sir_db": sir_db,
            }


def sweep_point(observation, objects, response, max_iterations):
    """Misses and strays of three methods at one point."""
    frame = observation.received[:, SETTLED:]
    noise = 1.0 / objects.noise_precision
    mask = np.abs(observation.truth.interference_signal[:, SETTLED:]) ** 2 > noise
    model = partial(model_with, num_samples=frame.shape[1])
    settings = {"max_iterations": max_iterations}
    states = {
        "separation": run(FactorisedSeparator(model=model(response), **settings), frame).state
    }
    zeroed = np.asarray(mitigate(make_mitigation("zeroing"), frame, mask).cleaned)
    states["zeroing"] = run(ObjectOnlySeparator(model=model(NoFilter()), **settings), zeroed).state
    states["masked"] = masked_lines(frame, mask, max_iterations)
    row = {"mask_share": float(mask.mean()), "objects_clean": objects.objects.num_components}
    for name, state in states.items():
        found, own = lines_of(state), lines_of(objects)
        near = partial(matched, shape=frame.shape)
        row[f"{name}_missed"] = int(np.sum(~near(own, found))) if len(found) else len(own)
        row[f"{name}_stray"] = int(np.sum(~near(found, own)))
    return row


def car_rows():
    """Yield the rows of the interfered recording, one an antenna."""
    signals, mask = recording(INTERFERED)
    response = calibrate([signals], RATE, SLOPE).estimate.response
    for index in range(len(signals)):
        yield car_row(index, signals, mask, response)


def main(folder):
    """Write both tables."""
    write_table(folder / "recording-20180608.csv", car_rows())
    sweep = sweep_rows((20e12, 5e12, 1e12, 0.5e12), (-40.0, -20.0, 0.0))
    write_table(folder / "recording-20180613-bursts.csv", sweep)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
