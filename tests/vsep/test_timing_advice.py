"""Which settings let the fewest bursts of another radar in."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vsep.analysis.timing_advice import OtherRadar, exposure, exposures
from vsep.errors import InputError
from vsep.signal.radar import ChirpSequence

RADAR = ChirpSequence(
    start_frequency_hz=77e9,
    slope_hz_per_s=30e12,
    sample_rate_hz=20e6,
    ramp_period_s=29.56e-6,
    num_samples=512,
    num_ramps=64,
)
OTHER = OtherRadar(slope_hz_per_s=10e12, ramp_period_s=72.3e-6)


def drawn(radar: ChirpSequence, other: OtherRadar, offset_s: float) -> Any:
    """Samples (ramps, samples) in whose band the other radar is, sample by sample."""
    assert other.start_frequency_hz is not None
    assert other.ramp_duration_s is not None
    ramp, sample = np.ogrid[: radar.num_ramps, : radar.num_samples]
    in_ramp = sample / radar.sample_rate_hz
    in_chirp = np.mod(radar.ramp_period_s * ramp + in_ramp - offset_s, other.ramp_period_s)
    mine = radar.start_frequency_hz + radar.slope_hz_per_s * in_ramp
    theirs = other.start_frequency_hz + other.slope_hz_per_s * in_chirp
    on = in_chirp < other.ramp_duration_s
    return on & (np.abs(mine - theirs) < 0.5 * radar.sample_rate_hz)


@pytest.mark.parametrize("slope", [10e12, -25e12, 29e12])
def test_the_shares_are_those_of_samples_looked_at_one_by_one(slope: float) -> None:
    other = replace(OTHER, slope_hz_per_s=slope, start_frequency_hz=77.3e9, ramp_duration_s=50e-6)
    offsets = other.ramp_period_s * np.arange(64) / 64
    hits = np.array([drawn(RADAR, other, offset) for offset in offsets])
    found = exposure(RADAR, [other])
    assert found.sample_share == pytest.approx(hits.mean(), rel=0.02)
    # A burst shorter than a sample may fall between two of them.
    assert found.ramp_share == pytest.approx(hits.any(axis=2).mean(), abs=0.02)
    assert found.worst_ramp_share == pytest.approx(hits.any(axis=2).mean(axis=1).max(), abs=0.04)


def test_a_radar_out_of_the_band_is_not_received() -> None:
    far = replace(OTHER, start_frequency_hz=79e9, ramp_duration_s=60e-6)
    found = exposure(RADAR, [far])
    assert (found.sample_share, found.ramp_share, found.worst_ramp_share) == (0.0, 0.0, 0.0)


def test_equal_slopes_and_periods_are_all_or_nothing() -> None:
    twin = OtherRadar(
        slope_hz_per_s=RADAR.slope_hz_per_s,
        ramp_period_s=RADAR.ramp_period_s,
        start_frequency_hz=RADAR.start_frequency_hz,
    )
    found = exposure(RADAR, [twin])
    # Within the band while the offset is less than half of it over the slope, on both sides.
    share = RADAR.sample_rate_hz / RADAR.slope_hz_per_s / RADAR.ramp_period_s
    assert found.ramp_share == pytest.approx(share, abs=1.0 / 64)
    assert found.worst_ramp_share == 1.0


def test_two_radars_hit_more_than_one() -> None:
    one, two = exposure(RADAR, [OTHER]), exposure(RADAR, [OTHER, OTHER])
    assert two.ramp_share == pytest.approx(1.0 - (1.0 - one.ramp_share) ** 2)


def test_every_combination_that_fits_its_period_is_tried() -> None:
    tried = list(
        exposures(
            RADAR,
            [OTHER],
            slopes_hz_per_s=(20e12, 30e12),
            ramp_periods_s=(20e-6, 30e-6, 40e-6),
            start_frequencies_hz=(77e9,),
        )
    )
    # 512 samples take 25.6 us.
    assert [each.radar.ramp_period_s for each in tried] == [30e-6, 40e-6] * 2
    too_many = exposures(
        RADAR,
        [OTHER],
        slopes_hz_per_s=tuple(np.linspace(20e12, 30e12, 200)),
        ramp_periods_s=tuple(np.linspace(3e-5, 4e-5, 200)),
        start_frequencies_hz=(77e9,),
    )
    with pytest.raises(InputError, match="40000 settings"):
        next(too_many)


def test_impossible_radars_are_refused() -> None:
    with pytest.raises(InputError, match="ramp_period_s"):
        replace(OTHER, ramp_period_s=0.0)
    with pytest.raises(InputError, match="ramp_duration_s"):
        replace(OTHER, ramp_duration_s=1e-3)
    with pytest.raises(InputError, match="chirps of the other radar overlap"):
        exposure(
            replace(RADAR, ramp_period_s=0.1, sample_rate_hz=1e4),
            [replace(OTHER, ramp_period_s=1e-7)],
        )
