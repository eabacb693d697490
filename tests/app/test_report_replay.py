import base64
import json
import re

import numpy as np
import pytest
from vsep_app.report.packed import packed_html, unpacked_html
from vsep_app.report.replay import (
    LEVELS,
    SHORT_CURVE,
    encoded,
    record_html,
    recorded_iterations,
    recorded_ramps,
    status,
)
from vsep_app.report.run import execute
from vsep_app.report.sources import of_preset
from vsep_app.report.variations import read_varied, varied_specs

from tests.app.conftest import finish
from tests.app.test_report import report_of
from vsep.errors import InputError


@pytest.fixture(scope="module")
def short_bursts():
    """Simulation II c, which has the most ramps with bursts."""
    return report_of(finish("simulation-2-c"))


@pytest.fixture(scope="module")
def record(short_bursts):
    """Its recorded run."""
    return record_html([short_bursts])


@pytest.fixture(scope="module")
def replay(record):
    """What the script of the page plays."""
    element = re.search(r'id="vsep-replay">(.*?)</script>', record, re.DOTALL)
    played = json.loads(element.group(1))
    (run,) = played["runs"]
    return played | run


def decode(value):
    """As the script does."""
    if value["kind"] == "list":
        return value["data"]
    if value["kind"] == "curve":
        codes = np.cumsum(value["data"])
        return np.where(codes == -1024, np.nan, value["lowest"] + codes * value["step"])
    content = base64.b64decode(value["data"])
    if value["kind"] == "map":
        return np.frombuffer(content, np.uint8)
    return np.frombuffer(content, "<f4")


def columns_of(replay, iteration, ramp, *names):
    """The columns of the first source that has them."""
    versions = replay["iterations"][iteration]["versions"][replay["ramps"].index(ramp)]
    for number in versions:
        _, kind, content = replay["versions"][number]
        if kind == "data" and set(names) <= set(content):
            yield [decode(replay["values"][content[name]]) for name in names]


def test_a_record_of_simulation_ii_has_less_than_1_mb_and_comes_back(record):
    packed = packed_html(record, title="vsep", provenance="<b></b>")
    assert len(packed.encode()) < 1_000_000
    assert unpacked_html(packed) == record


@pytest.mark.parametrize("iteration", [0, 3, -1])
def test_a_record_holds_the_pictures_of_the_run(short_bursts, replay, iteration):
    shown = range(len(short_bursts.steps) + 1)[iteration]
    for ramp in replay["ramps"]:
        picture = short_bursts.picture(shown, ramp)
        fast_time, _ = columns_of(replay, iteration, ramp, "cleaned", "interference")
        for curve, name in zip(fast_time, ("cleaned", "interference"), strict=True):
            wanted = getattr(picture.fast_time, name)
            # Half a step of 766 over the curve's span, and float32, 6e-8 of 200 dB.
            known = wanted[np.isfinite(wanted)]
            half_step = np.ptp(known) / LEVELS / 2.0 if known.size else 0.0
            np.testing.assert_allclose(curve, wanted, rtol=0, atol=half_step + 2.4e-5)
        maps = [image for [image] in columns_of(replay, iteration, ramp, "image")]
        # Dark as long as no burst is modelled.
        after = picture.map_after.ravel() * picture.is_cleaned
        assert any(np.array_equal(image, after) for image in maps)
    assert replay["iterations"][iteration]["status"] == status(picture, len(short_bursts.steps))


def test_every_ramp_with_a_burst_can_be_chosen(short_bursts, replay):
    assert replay["ramps"] == list(np.flatnonzero(short_bursts.static_picture.true_ramps))
    assert replay["ramps"][replay["ramp"]] == short_bursts.ramp


def test_a_long_run_shows_fewer_ramps(many_ramps):
    run = report_of(many_ramps)
    assert len(recorded_ramps(run, 2)) == 2
    assert run.ramp in recorded_ramps(run, 2)
    assert recorded_ramps(run, 1) == recorded_ramps(run, 0) == [run.ramp]


def test_a_run_of_one_ramp_is_recorded_without_a_choice(one_ramp):
    html = record_html([report_of(one_ramp)])
    assert 'id="ramp"' not in html
    assert 'id="iteration"' in html


def test_runs_of_varied_settings_are_played_by_their_sliders():
    spec = of_preset("simulation-1")
    varied = read_varied(["sir=-20,0,20", "snr=20,40"], spec.plan)
    runs = [execute(each) for each in varied_specs(spec, varied)]
    levels = [(run.spec.plan.sir_db, run.spec.plan.snr_db) for run in runs]
    assert levels == [(sir, snr) for sir in (-20.0, 0.0, 20.0) for snr in (20.0, 40.0)]
    html = record_html(runs, varied)
    played = json.loads(re.search(r'id="vsep-replay">(.*?)</script>', html, re.DOTALL)[1])
    assert [each["label"] for each in played["varied"]] == ["SIR [dB, total]", "SNR [dB, total]"]
    assert [run["levels"] for run in played["runs"]] == [
        run.static_picture.levels_text for run in runs
    ]
    for run, recorded in zip(runs, played["runs"], strict=True):
        assert recorded["numbers"] == recorded_iterations(len(run.steps), len(runs))
        assert len(recorded["iterations"]) == len(recorded["numbers"])
        assert recorded["numbers"][-1] == len(run.steps)
        (level,) = (
            content
            for number in recorded["axes"]
            for _, _, content in [played["versions"][number]]
            if content.get("start") == run.static_picture.level_limits_db[0]
            and content.get("end") == run.static_picture.level_limits_db[1]
        )
        assert level["reset_start"] == level["start"]
    assert len(packed_html(html, title="").encode()) < 1_000_000


@pytest.mark.parametrize(
    ("texts", "told"),
    [
        (["volume=1,2"], "volume=1,2"),
        (["sir"], "sir=-30,-20,-10"),
        (["sir=-20,loud"], "sir is loud; it must be a number"),
        (["sir=-20,900"], "sir is 900"),
        (["interference=0,1"], "interference=0,1"),
        (["sir=0,1", "sir=2,3"], "give each once"),
        (["sir=0,1", "snr=20,30", "slope=9,9.2"], "8 runs over 3 settings"),
        (["seed=1,2,3,4,5,6,7,8,9,10,11,12,13"], "13 runs over 1 settings"),
    ],
)
def test_what_cannot_be_varied_is_told(texts, told):
    with pytest.raises(InputError, match=re.escape(told)):
        read_varied(texts, of_preset("simulation-1").plan)


@pytest.mark.parametrize("length", [1, SHORT_CURVE, SHORT_CURVE + 1, 300])
def test_curves_come_back_within_half_a_step(length):
    rng = np.random.default_rng(3)
    curve = rng.normal(size=length) * 40.0
    curve[length // 2 :: 5] = np.nan
    error = np.abs(decode(encoded(curve)) - curve)
    span = np.nanmax(curve) - np.nanmin(curve) if np.isfinite(curve).any() else 0.0
    # A short curve is float32: 6e-8 of at most 200.
    bound = span / LEVELS / 2.0 * (1.0 + 1e-6) if length > SHORT_CURVE else 1.2e-5
    assert np.array_equal(np.isnan(error), np.isnan(curve))
    assert not (error > bound).any()


def test_a_constant_and_an_undefined_curve_come_back():
    assert np.array_equal(decode(encoded(np.full(99, 7.25))), np.full(99, 7.25))
    assert np.isnan(decode(encoded(np.full(99, np.nan)))).all()
    assert decode(encoded([np.float64(1.5), "none"])) == [1.5, "none"]
