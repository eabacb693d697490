"""`vsep.analysis.interferer_timing`: radars told from when their bursts cross."""

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vsep._typing import ComplexArray
from vsep.analysis.crossings import Crossings
from vsep.analysis.interferer_timing import fit_interferer_timings
from vsep.errors import InputError
from vsep.files.timing_lines import FrameTimings, timing_line
from vsep.inference.core.run import run
from vsep.inference.factorised import FactorisedSeparator
from vsep.signal.bursts import true_bursts
from vsep.signal.filters import ButterworthFilter, RaisedCosineFilter
from vsep.signal.radar import ChirpSequence, InterfererSequence
from vsep.signal.template import SignalModel

RECORDINGS = Path(os.environ.get("VSEP_RECORDINGS", "nowhere"))
RATE, VICTIM_SLOPE, VICTIM_PERIOD = 20e6, 29.306e12, 29.56e-6
OTHER_SLOPE, OTHER_PERIOD = 9.994e12, 72.2965e-6
FILTER = RaisedCosineFilter(cutoff_hz=RATE / 4, rolloff=0.25)
ADC_START_S, CROPPED = 1.66e-6, 60
RADAR = ChirpSequence(
    start_frequency_hz=77e9 + VICTIM_SLOPE * (ADC_START_S + CROPPED / RATE),
    slope_hz_per_s=VICTIM_SLOPE,
    sample_rate_hz=RATE,
    ramp_period_s=VICTIM_PERIOD,
    num_samples=512 - CROPPED,
    num_ramps=128,
)


def interferer(**changes: Any) -> InterfererSequence:
    values = {
        "start_frequency_hz": 77e9,
        "slope_hz_per_s": OTHER_SLOPE,
        "ramp_duration_s": 70.31e-6,
        "ramp_period_s": OTHER_PERIOD,
        "num_ramps": 128,
        "time_offset_s": -0.33e-3,
    }
    return InterfererSequence(**(values | changes))


def simulated(*sequences: InterfererSequence, radar: ChirpSequence = RADAR) -> Crossings:
    """Crossings of the simulator's bursts, those inside of the ramps."""
    bursts = [
        (burst.ramp, -burst.start_frequency_hz / burst.slope_hz_per_s * RATE, burst.slope_hz_per_s)
        for sequence in sequences
        for burst in true_bursts(radar, sequence, FILTER)
    ]
    ramps, samples, slopes = np.array(bursts).T
    inside = (samples >= 0) & (samples <= radar.num_samples - 1)
    every = Crossings(ramps=ramps.astype(int), samples=samples, slopes_hz_per_s=slopes)
    return every.select(inside)


def disturbed(
    crossings: Crossings, *, deviation: float, outliers: float, kept: float, seed: int
) -> Crossings:
    """Crossings as an estimator finds them: noisy, some missing, some wrong, slopes 0.3 % off."""
    rng = np.random.default_rng(seed)
    part = crossings.select(rng.random(len(crossings.ramps)) < kept)
    count = len(part.ramps)
    samples = part.samples + deviation * rng.standard_normal(count)
    wrong = rng.random(count) < outliers
    samples[wrong] = rng.uniform(0, RADAR.num_samples, np.sum(wrong))
    slopes = part.slopes_hz_per_s * 1.003 * (1.0 + 0.005 * rng.standard_normal(count))
    return Crossings(ramps=part.ramps, samples=samples, slopes_hz_per_s=slopes)


def test_exact_crossings_give_the_interferer_exactly() -> None:
    crossings = simulated(interferer())
    (timing,) = fit_interferer_timings(crossings, RADAR)
    assert len(timing.chirps) == len(crossings.ramps) > 60
    assert timing.slope_hz_per_s == pytest.approx(OTHER_SLOPE, rel=1e-9)
    assert timing.ramp_period_s == pytest.approx(OTHER_PERIOD, rel=1e-9)
    assert np.abs(timing.residuals).max() < 1e-6


@pytest.mark.parametrize(
    ("slope", "period"),
    [(-15e12, 31e-6), (45e12, 41.3e-6), (60e12, 20.1e-6), (2e12, 55e-6)],
    ids=["falling", "steeper", "several in a ramp", "flat"],
)
def test_other_radars_are_told_as_well(slope: float, period: float) -> None:
    # The start is so low or high that the chirps cross the victim's band.
    start = 77.4e9 - slope * period / 2
    sequence = interferer(
        slope_hz_per_s=slope,
        ramp_period_s=period,
        ramp_duration_s=period,
        start_frequency_hz=start,
        num_ramps=400,
    )
    (timing,) = fit_interferer_timings(simulated(sequence), RADAR)
    assert timing.slope_hz_per_s == pytest.approx(slope, rel=1e-8)
    assert timing.ramp_period_s == pytest.approx(period, rel=1e-8)


@pytest.mark.parametrize(
    ("deviation", "outliers", "kept"), [(0.07, 0.0, 1.0), (0.07, 0.25, 1.0), (0.2, 0.25, 0.5)]
)
def test_wrong_and_missing_bursts_do_not_matter(
    deviation: float, outliers: float, kept: float
) -> None:
    exact = simulated(interferer())
    found = disturbed(exact, deviation=deviation, outliers=outliers, kept=kept, seed=5)
    timing = fit_interferer_timings(found, RADAR)[0]
    # Uniform chirps and ramps: a step is known to sqrt(12 / B) deviations over their extent.
    extent = 0.25 * 128 * VICTIM_PERIOD / OTHER_PERIOD
    exactness = 5 * deviation * np.sqrt(12 / len(timing.chirps)) / extent / abs(timing.step)
    assert timing.ramp_period_s == pytest.approx(OTHER_PERIOD, rel=exactness)
    # The median of the magnitudes of normal errors is 0.67 deviations; a fit only lowers it.
    assert timing.median_residual < deviation
    predicted = timing.predicted()
    places = {(r, round(s)): s for r, s in zip(predicted.ramps, predicted.samples, strict=True)}
    for ramp, sample in zip(exact.ramps, exact.samples, strict=True):
        near = [places.get((ramp, round(sample) + step), np.inf) for step in (-1, 0, 1)]
        assert min(abs(place - sample) for place in near) < 3 * deviation


def test_the_simulator_redraws_what_was_fitted() -> None:
    (timing,) = fit_interferer_timings(simulated(interferer()), RADAR)
    redrawn = simulated(timing.sequence())
    predicted = timing.predicted()
    drawn = set(zip(redrawn.ramps, redrawn.samples.round(4), strict=True))
    # The simulator leaves out what an interferer cuts off at the ends of its chirps.
    assert drawn <= set(zip(predicted.ramps, predicted.samples.round(4), strict=True))
    original = simulated(interferer())
    assert set(zip(original.ramps, original.samples.round(4), strict=True)) <= set(
        zip(predicted.ramps, predicted.samples.round(4), strict=True)
    )
    assert len(drawn) >= len(original.ramps)


def test_two_interferers_have_a_timing_each() -> None:
    other = interferer(slope_hz_per_s=50e12, ramp_period_s=33.7e-6, ramp_duration_s=33e-6)
    found = fit_interferer_timings(simulated(interferer(), other), RADAR)
    assert sorted(round(each.slope_hz_per_s / 1e9) for each in found) == [9994, 50000]


def test_what_a_fit_leaves_of_a_burst_is_no_second_interferer() -> None:
    first = simulated(interferer())
    ghosts = Crossings(
        ramps=first.ramps, samples=first.samples + 2.0, slopes_hz_per_s=-1.5 * first.slopes_hz_per_s
    )
    both = Crossings(
        ramps=np.append(first.ramps, ghosts.ramps),
        samples=np.append(first.samples, ghosts.samples),
        slopes_hz_per_s=np.append(first.slopes_hz_per_s, ghosts.slopes_hz_per_s),
    )
    (timing,) = fit_interferer_timings(both, RADAR)
    assert timing.slope_hz_per_s == pytest.approx(OTHER_SLOPE, rel=1e-6)


def test_bursts_anywhere_have_no_timing() -> None:
    rng = np.random.default_rng(7)
    for count in (3, 4, 5, 12, 40):
        crossings = Crossings(
            ramps=np.sort(rng.integers(0, 128, count)),
            samples=rng.uniform(0, RADAR.num_samples, count),
            slopes_hz_per_s=np.full(count, OTHER_SLOPE - VICTIM_SLOPE),
        )
        assert fit_interferer_timings(crossings, RADAR) == ()


@pytest.mark.parametrize("slope", [0.0, -VICTIM_SLOPE])
def test_no_slope_that_makes_no_timing_is_a_breakdown(slope: float) -> None:
    crossings = Crossings(
        ramps=np.arange(10), samples=np.full(10, 50.0), slopes_hz_per_s=np.full(10, slope)
    )
    assert fit_interferer_timings(crossings, RADAR) == ()


@pytest.mark.parametrize("spread", [0.01, 2.0])
def test_twenty_thousand_bursts_anywhere_take_a_few_seconds(spread: float) -> None:
    rng = np.random.default_rng(4)
    count = 20_000
    crossings = Crossings(
        ramps=rng.integers(0, RADAR.num_ramps, count),
        samples=rng.uniform(0.0, RADAR.num_samples, count),
        slopes_hz_per_s=-2e12 * (1.0 + rng.uniform(-spread, spread, count)),
    )
    start = time.process_time()
    assert fit_interferer_timings(crossings, RADAR) == ()
    assert time.process_time() - start < 5.0


def test_a_frame_of_hours_is_refused_before_it_is_searched() -> None:
    radar = replace(RADAR, ramp_period_s=100.0)
    crossings = Crossings(
        ramps=np.arange(8), samples=np.full(8, 3.0), slopes_hz_per_s=np.full(8, -2e12)
    )
    with pytest.raises(InputError, match="too long to search"):
        fit_interferer_timings(crossings, radar)


def test_unusable_crossings_are_refused() -> None:
    with pytest.raises(InputError, match="lists of one length"):
        Crossings(ramps=np.arange(3), samples=np.ones(2), slopes_hz_per_s=np.ones(3))
    with pytest.raises(InputError, match="NaN or infinite"):
        Crossings(ramps=np.arange(1), samples=np.array([np.nan]), slopes_hz_per_s=np.ones(1))


def with_gap(ramp: int, gap_s: float, *, pauses: bool, period: float = OTHER_PERIOD) -> Crossings:
    """Crossings of a frame in which the victim, or the interferer, stops for a while at a ramp."""
    before = interferer(num_ramps=4000, time_offset_s=-30.33e-3, ramp_period_s=period)
    # Of a victim that pauses the later ramps are later than their numbers say, so that the
    # interferer's chirps come earlier; an interferer that pauses sends later ones.
    shift = gap_s if pauses else -gap_s
    after = replace(before, time_offset_s=before.time_offset_s + shift)
    first, second = simulated(before), simulated(after)
    parts = first.select(first.ramps < ramp), second.select(second.ramps >= ramp)
    return Crossings(
        ramps=np.concatenate([part.ramps for part in parts]),
        samples=np.concatenate([part.samples for part in parts]),
        slopes_hz_per_s=np.concatenate([part.slopes_hz_per_s for part in parts]),
    )


@pytest.mark.parametrize(("ramp", "pauses"), [(32, False), (64, True), (100, False)])
@pytest.mark.parametrize("gap_s", [7.137e-3, 0.5 * OTHER_PERIOD, OTHER_PERIOD / 11.0])
def test_behind_a_gap_the_same_radar_is_told_again(ramp: int, gap_s: float, pauses: bool) -> None:
    crossings = with_gap(ramp, gap_s, pauses=pauses)
    found = disturbed(crossings, deviation=0.07, outliers=0.05, kept=0.9, seed=3)
    timings = fit_interferer_timings(found, RADAR)
    assert len(timings) in (1, 2)
    for timing in timings:
        # 11 bursts at least, over a fifth of the frame
        assert timing.ramp_period_s == pytest.approx(OTHER_PERIOD, rel=1e-3)
        assert timing.merit > 0.8
    # Not all of a short part need be told.
    told = sum(len(timing.chirps) for timing in timings)
    assert told >= 0.7 * len(found.ramps)
    predicted = sum(len(timing.predicted().ramps) for timing in timings)
    assert predicted <= 1.25 * len(crossings.ramps)


def test_a_fraction_of_the_step_is_no_evidence() -> None:
    (timing,) = fit_interferer_timings(simulated(interferer()), RADAR)
    assert timing.merit > 0.95
    eleventh = replace(timing, step=timing.step / 11.0, chirps=11 * timing.chirps)
    assert np.abs(eleventh.residuals).max() < 1e-6
    assert eleventh.merit < 0.15


# The recording of a car and a second radar


@pytest.fixture(scope="module")
def recorded() -> Crossings:
    """Bursts that one iteration of the separator finds in the interfered recording."""
    path = RECORDINGS / "radarlab_20180608-195044.npz"
    if not path.is_file():
        pytest.skip("VSEP_RECORDINGS names no folder with the recording")
    with np.load(path) as archive:
        received: ComplexArray = archive["x"][0, :, CROPPED:].astype(np.complex128).conj()
    # A published stand-in for the receiver: low-pass of order 10; 8 is the steepest here.
    model = SignalModel.of_radar(RADAR, ButterworthFilter(cutoff_hz=8.57e6, order=8))
    bursts = run(FactorisedSeparator(model=model, max_iterations=1), received).state.bursts
    return Crossings(
        ramps=np.array([burst.ramp for burst in bursts]),
        samples=np.array([burst.centre for burst in bursts]),
        slopes_hz_per_s=np.array([burst.slope for burst in bursts]) * RATE**2,
    )


def test_the_radar_of_a_recording_is_told(recorded: Crossings) -> None:
    (timing,) = fit_interferer_timings(recorded, RADAR)
    # 9.994 MHz/us by its settings; measured in the victim's clock the interval is 72.2965 us.
    assert timing.slope_hz_per_s == pytest.approx(9.994e12, rel=1e-3)
    assert timing.ramp_period_s == pytest.approx(72.2965e-6, abs=1e-10)
    assert timing.median_residual < 0.1
    assert len(timing.chirps) > 0.9 * len(recorded.ramps)


def test_the_simulator_redraws_the_recording(recorded: Crossings) -> None:
    """Both radars' settings are given; one offset and one clock ratio are fitted."""
    (timing,) = fit_interferer_timings(recorded, RADAR)
    difference = OTHER_SLOPE - VICTIM_SLOPE
    drift = -OTHER_SLOPE * VICTIM_PERIOD / difference * RATE
    nominal_step = OTHER_SLOPE * 72.31e-6 / difference * RATE
    own = timing.crossings
    columns = np.stack([nominal_step * timing.chirps, np.ones(len(own.ramps))], axis=1)
    ratio, first = np.linalg.lstsq(columns, own.samples - drift * own.ramps)[0]
    period = 72.31e-6 * ratio
    # The frequencies at the first sample differ by what the ramp did before it.
    start = RADAR.start_frequency_hz - 77e9
    offset = (first / RATE * difference - start) / OTHER_SLOPE
    sequence = interferer(
        ramp_period_s=period,
        time_offset_s=offset - 400 * period,
        num_ramps=1000,
        ramp_duration_s=period,
    )
    redrawn = simulated(sequence)
    errors = []
    for ramp, sample in zip(recorded.ramps, recorded.samples, strict=True):
        drawn = redrawn.samples[redrawn.ramps == ramp]
        errors.append(np.abs(drawn - sample).min() if len(drawn) else np.inf)
    # Against all bursts that were found, the wrong ones too.
    assert np.median(errors) <= 0.1


def incomplete(seed: int) -> tuple[float, Crossings]:
    """The interval of an interferer at random, and part of its bursts, with gaps and wrong ones."""
    rng = np.random.default_rng([19, seed])
    period = rng.uniform(35e-6, 180e-6)
    slope = rng.choice([rng.uniform(3e12, 24e12), rng.uniform(-40e12, -5e12)])
    gaps = rng.integers(0, 3)
    edges = [0, *sorted(rng.integers(10, 118, gaps)), RADAR.num_ramps]
    shifts = np.cumsum([0.0, *rng.uniform(1e-3, 20e-3, gaps)])
    sequence = interferer(
        slope_hz_per_s=slope,
        ramp_period_s=period,
        ramp_duration_s=min(0.9 * period, 1.5e9 / abs(slope)),
        num_ramps=4000,
        start_frequency_hz=77e9 if slope > 0.0 else 78e9,
    )
    bursts = []
    for low, high, shift in zip(edges[:-1], edges[1:], shifts, strict=True):
        part = simulated(replace(sequence, time_offset_s=shift - 30e-3))
        inside = (part.ramps >= low) & (part.ramps < high)
        bursts.append((part.ramps[inside], part.samples[inside], part.slopes_hz_per_s[inside]))
    ramps, samples, slopes = (np.concatenate(each) for each in zip(*bursts, strict=True))
    every = Crossings(ramps=ramps, samples=samples, slopes_hz_per_s=slopes)
    share, wrong = rng.uniform(0.1, 1.0), rng.uniform(0.0, 0.25)
    return period, disturbed(every, deviation=0.1, outliers=wrong, kept=share, seed=seed)


def test_of_incomplete_bursts_no_interval_is_wrong_without_a_word() -> None:
    right = 0
    for seed in range(20):
        period, crossings = incomplete(seed)
        timings = fit_interferer_timings(crossings, RADAR)
        frame = FrameTimings(
            file="a", radar=RADAR, crossings=crossings, timings=timings, parallel_ramps=()
        )
        for timing in timings:
            is_right = abs(timing.ramp_period_s / period - 1.0) < 2e-3
            assert is_right or "remark" in timing_line(frame)
        right += bool(timings)
        assert timings or len(crossings.ramps) == 0 or "remark" in timing_line(frame)
    assert right >= 6
