import json
from dataclasses import replace

import pytest
from vsep_app.report import spec as specs
from vsep_app.report.metadata import for_html, read_provenance
from vsep_app.report.spec import KeptFrame, ReportSpec, default_plan, read_spec, spec_data

from vsep.errors import InputError

FRAME = KeptFrame(name="night.npz", content=b"\x00\xff content")
FULL = ReportSpec(
    plan=replace(default_plan("simulation-2-b"), estimator="masked", object_threshold_db=None),
    frame=FRAME,
    mask="amplitude",
    interference_threshold_db=4.5,
    ramp=3,
    iteration=7,
    iterations=(1, 2),
    fast_time="real",
)


@pytest.mark.parametrize(
    "spec", [FULL, ReportSpec(plan=default_plan()), ReportSpec(plan=default_plan(), trial="a/1/2")]
)
def test_a_spec_comes_back_from_json(spec):
    assert read_spec(json.loads(json.dumps(spec_data(spec))), "a.html") == spec


def _broken(**changes):
    data = spec_data(FULL)
    plan = {key[5:]: changes.pop(key) for key in tuple(changes) if key.startswith("plan_")}
    return {**data, **changes, "plan": {**data["plan"], **plan}}


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        {},
        {**spec_data(FULL), "more": 1},
        _broken(ramp=-1),
        _broken(ramp=True),
        _broken(iteration=1.5),
        _broken(iteration=10**19),
        _broken(iterations=[1, "2"]),
        _broken(iterations=3),
        _broken(fast_time="colour"),
        _broken(interference_threshold_db=float("inf")),
        _broken(plan_preset="elsewhere"),
        _broken(plan_seed=1.5),
        _broken(plan_interference=1),
        _broken(plan_filter_cutoff=0.0),
        _broken(plan_interferer_slope="9"),
        _broken(plan_estimator=["masked"]),
        _broken(plan_more=1),
        _broken(frame={"name": "x"}),
        _broken(frame={**spec_data(FULL)["frame"], "npz": "no base 64"}),
        _broken(frame={**spec_data(FULL)["frame"], "sha256": "0" * 64}),
    ],
)
def test_what_is_no_spec_is_one_sentence(data):
    with pytest.raises(InputError, match=r"a\.html"):
        read_spec(data, "a.html")


def test_a_large_frame_is_named_and_asked_for(monkeypatch):
    monkeypatch.setattr(specs, "MAX_KEPT", 3)
    data = spec_data(FULL)
    assert data["frame"]["npz"] is None
    with pytest.raises(InputError, match=r"too large; give night\.npz as well"):
        read_spec(data, "a.html")
    moved = KeptFrame(name="moved/night.npz", content=FRAME.content)
    assert read_spec(data, "a.html", moved) == FULL
    with pytest.raises(InputError, match=r"is not the frame of a\.html"):
        read_spec(data, "a.html", KeptFrame(name="other.npz", content=b"other"))


def test_a_frame_that_is_not_needed_is_refused():
    with pytest.raises(InputError, match="made without a frame"):
        read_spec(spec_data(ReportSpec(plan=default_plan())), "a.html", FRAME)


def test_no_text_of_an_account_ends_its_element(tmp_path):
    told = {"spec": {"name": "</script><script>alert(1)</script>"}}
    element = for_html(told)
    assert element.count("<") == 2
    (tmp_path / "a.html").write_text(f"<html>{element}</html>")
    assert read_provenance(tmp_path / "a.html") == told


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<html></html>",
        b"\xff\xfe",
        b"%PDF-1.4",
        b"%PDF /Keywords (vsep:AAA)",
        b"\x89PNG",
        b"GIF89a",
        b"RIFFxxxxWEBP",
        b"{",
        b"{}",
        b'{"spec"',
        b'<script type="application/json" id="vsep-account">[]</script>',
    ],
)
def test_a_file_that_says_nothing_of_itself_is_one_sentence(tmp_path, content):
    path = tmp_path / "a.html"
    path.write_bytes(content)
    with pytest.raises(InputError, match="does not say how it was made"):
        read_provenance(path)
